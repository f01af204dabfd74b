"""The published figure, computed again: the wanted pressure on the skin and the pressure of each method."""

import collections

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.collections import LineCollection, PolyCollection  # noqa: E402

from runs import LABELS, METRICS, SCENES, results, skin  # noqa: E402

COLUMNS = ["paper", "unscattered", "surface", "radiation", "focus"]
MARGIN = 0.006  # m of skin around the target


# What a figure shows of the skin, its unit in Pa, and the metrics that stand above its panels.
Quantity = collections.namedtuple("Quantity", "wanted obtained unit label error width")
PRESSURE = Quantity("wanted", "pressure", 1e3, "absolute pressure on the skin [kPa]", "relative_error", "width_mm")
RADIATION = Quantity("wanted_radiation", "radiation", 1, "radiation pressure on the skin [Pa]", "relative_error_radiation",
                     "width_radiation_mm")


def outline(one):
    """Line segments [n, 2, 2] (x, y in mm) around the target, without those on the far side of the body."""
    owners = {}
    for face in numpy.flatnonzero(one.wanted):
        a, b, c = one.triangles[face]
        for i, (start, end) in enumerate(((a, b), (b, c), (c, a))):
            owners.setdefault((min(start, end), max(start, end)), []).append((face, i))
    edges = [users[0] for users in owners.values() if len(users) == 1]
    return numpy.array([[one.corners[face][i][:2], one.corners[face][(i + 1) % 3][:2]] for face, i in edges
                        if one.normals[face][2] < 0.2]) * 1e3


def draw(axes, one, values, largest, window):
    """The skin as the array sees it, from below. Parallel projection along z: +y is up, +x points to the left."""
    seen = numpy.flatnonzero(one.normals[:, 2] < 0)
    seen = seen[numpy.argsort(-one.corners[seen, :, 2].mean(axis=1))]  # the far ones first
    faces = PolyCollection(one.corners[seen, :, :2] * 1e3, array=values[seen], cmap="viridis", edgecolors="face",
                           linewidths=0.2, rasterized=True)
    faces.set_clim(0, largest)
    axes.add_collection(faces)
    for colour, width in (("black", 2.2), ("white", 1.0)):  # visible on dark and bright colours
        axes.add_collection(LineCollection(outline(one), colors=colour, linewidths=width))
    (left, right), (low, high) = window
    axes.set_xlim(right, left)
    axes.set_ylim(low, high)
    axes.set_aspect("equal")
    axes.set_facecolor("0.93")
    return faces


def window_of(one):
    corners = one.corners[one.wanted > 0].reshape(-1, 3)
    middle = 0.5 * (corners.max(axis=0) + corners.min(axis=0))[:2]
    half = 0.5 * float((corners.max(axis=0) - corners.min(axis=0))[:2].max()) + MARGIN
    return [tuple(1e3 * (middle[axis] + side * half) for side in (-1, 1)) for axis in (0, 1)]


def figure(folders, path, quantity=PRESSURE, columns=None):
    """One row per scene, one column per method. Each row has one colour scale: 0 to 1.5 times the largest wanted pressure.

    folders   {scene: folder of its run}
    columns   {method of the runs: its heading}
    """
    names, columns = list(folders), columns or {method: LABELS[method] for method in COLUMNS}
    wide, high = 3 + 3 * len(columns), 0.9 + 3.05 * len(names)
    drawing, grid = pyplot.subplots(len(names), 2 + len(columns), figsize=(wide, high), squeeze=False,
                                    gridspec_kw={"width_ratios": [1] * (1 + len(columns)) + [0.06], "left": 1.25 / wide,
                                                 "right": 1 - 0.8 / wide, "top": 1 - 0.75 / high, "bottom": 0.5 / high,
                                                 "hspace": 0.32, "wspace": 0.1})
    for row, name in zip(grid, names):
        one = skin(folders[name])
        metrics = results(folders[name])
        wanted, obtained = getattr(one, quantity.wanted) / quantity.unit, getattr(one, quantity.obtained)
        largest = 1.5 * wanted.max()
        window = window_of(one)
        for axes, method in zip(row, [None, *columns]):
            faces = draw(axes, one, wanted if method is None else obtained[method] / quantity.unit, largest, window)
            if method is None:
                axes.set_title("wanted" if name == names[0] else "", fontsize=12)
                axes.set_ylabel(f"{SCENES[name]}\n\ny [mm]", fontsize=12)
                axes.set_xlabel("x [mm]")
                continue
            known = metrics[method]
            # A box between several fingers has no width on any of them.
            width = known[quantity.width]
            width = "" if name == "grasp" or width != width else f", width {width:.1f} mm"
            axes.set_title((columns[method] + "\n" if name == names[0] else "")
                           + f"error {100 * known[quantity.error]:.1f} %{width}", fontsize=11)
            axes.tick_params(labelleft=False, labelbottom=False)
        drawing.colorbar(faces, cax=row[-1], extend="max", label=quantity.label)
    drawing.savefig(path, dpi=80)
    pyplot.close(drawing)


def metric_rows(work, names, folder):
    """All metrics and the largest P, one row per scene and method."""
    rows = []
    for name in names:
        for method, known in results(work / folder / name).items():
            rows.append({"scene": name, "method": method, "scheme": known["scheme"]}
                        | {metric: f"{float(known[metric]):.9g}" for metric in METRICS}
                        | {"peak_radiation_pa": f"{known['peak_radiation_pa']:.9g}", "status": known["status"]})
    return rows
