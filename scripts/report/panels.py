"""The published figure, computed again: the wanted pressure on the skin and the pressure of each method."""

import dataclasses
import math

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.collections import LineCollection, PolyCollection  # noqa: E402

from runs import LABELS, METRICS, SCENES, attributes, number, percent, skin  # noqa: E402

COLUMNS = ["paper", "unscattered", "surface", "radiation", "focus"]
MARGIN = 0.006  # m of skin around the target


@dataclasses.dataclass
class Quantity:
    """What a figure shows of the skin, and the metrics that stand above its panels."""

    wanted: str  # of runs.Skin
    obtained: str
    unit: float  # of the figure, in Pa
    label: str
    error: str
    width: str


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
        metrics = attributes(folders[name])
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
        radiation = skin(work / folder / name).radiation
        for method, known in attributes(work / folder / name).items():
            rows.append({"scene": name, "method": method, "scheme": known["scheme"]}
                        | {metric: f"{float(known[metric]):.9g}" for metric in METRICS}
                        | {"peak_radiation_pa": f"{radiation[method].max():.9g}", "status": known["status"]})
    return rows


def short_table(rows):
    """Header and rows of the most important metrics."""
    header = ["scene", "method", "scheme", "error", "optimality gap", "error of P", "width, wanted / obtained / of P [mm]",
              "length, wanted / of P [mm]", "leakage", "mean pressure on the target / peak [kPa]",
              "force on the target / outside / sum of abs(P) A outside [mN]", "loudest P outside / mean on the target",
              "difference between the meshes, all skin / near the target"]
    shown = []
    for row in rows:
        shown.append([row["scene"], f"`{row['method']}`", row["scheme"], percent(row["relative_error"]),
                      percent(row[gap_of(row)], 2), percent(row["relative_error_radiation"]),
                      " / ".join(number(row[width], 2) for width in ("width_wanted_mm", "width_mm", "width_radiation_mm")),
                      " / ".join(number(row[length], 2) for length in ("length_wanted_mm", "length_radiation_mm")),
                      percent(row["leakage"]), f"{float(row['mean_inside_pa']) / 1e3:.1f} / {float(row['peak_pa']) / 1e3:.1f}",
                      " / ".join(f"{1e3 * float(row[force]):.2f}" for force in ("force_target_n", "force_elsewhere_n",
                                                                               "abs_force_elsewhere_n")),
                      number(row["loudest_elsewhere"], 2),
                      f"{percent(row['evaluation_difference'])} / {percent(row['evaluation_difference_target'])}"])
    return header, shown


def gap_of(row):
    """The metric with the gap of the method's own cost; other methods are held against the bound of `surface`."""
    return "optimality_gap_radiation" if row["method"] == "radiation" else "optimality_gap"


def differences(error, names, method, other):
    """In percentage points, one per scene."""
    return ", ".join(f"{SCENES[name]} {100 * (error[name, method] - error[name, other]):+.1f}" for name in names)


def sentences(rows, names):
    """Comparison of the methods over the scenes."""
    error = {(row["scene"], row["method"]): float(row["relative_error"]) for row in rows}
    said = []
    helps = [name for name in names if error[name, "paper"] < error[name, "unscattered"]]
    said.append(f"With scattering in the solver (`paper`), the evaluated error is lower than without (`unscattered`) on "
                f"{len(helps)} of {len(names)} scenes. In percentage points, `paper` minus `unscattered` is: "
                f"{differences(error, names, 'paper', 'unscattered')}.")
    if len(helps) < len(names):
        said.append("Scattering in the solver does not lower the error on: "
                    + ", ".join(SCENES[name] for name in names if name not in helps) + ".")
    original = [name for name in names if error[name, "paper_original"] < error[name, "unscattered_original"]]
    said.append(f"With the published scattering model and equal weights, the error of `paper_original` is lower than that of "
                f"`unscattered_original` on {len(original)} of {len(names)} scenes. In percentage points, `paper_original` minus "
                f"`unscattered_original` is: {differences(error, names, 'paper_original', 'unscattered_original')}.")
    ours = [name for name in names if error[name, "surface"] <= error[name, "paper"]]
    said.append(f"The error of `surface` is at most that of `paper` on {len(ours)} of {len(names)} scenes. In percentage points, "
                f"`surface` minus `paper` is: {differences(error, names, 'surface', 'paper')}.")
    boxes = [name for name in names if name.startswith("width_")]
    for key, of in (("width_mm", "abs(p)^2"), ("width_radiation_mm", "the radiation pressure P")):
        width = {(row["scene"], row["method"]): float(row[key]) for row in rows}
        largest = max(abs(width[name, "paper"] - width[name, "unscattered"]) for name in boxes)
        said.append(f"The full widths at half maximum of {of} for " + ", ".join(SCENES[name] for name in boxes) + " are, in mm: "
                    + "; ".join(f"`{method}` " + ", ".join(f"{width[name, method]:.1f}" for name in boxes)
                                for method in ("surface", "radiation", "paper", "unscattered", "focus"))
                    + f". The widths of `paper` and `unscattered` differ by at most {largest:.1f} mm.")
    leakage = {(row["scene"], row["method"]): float(row["leakage"]) for row in rows}
    less = [name for name in names if leakage[name, "paper"] < leakage[name, "unscattered"]]
    said.append(f"The leakage of `paper` is lower than that of `unscattered` on {len(less)} of {len(names)} scenes. In percentage "
                f"points, `paper` minus `unscattered` is: {differences(leakage, names, 'paper', 'unscattered')}.")
    return [*said, pressed(rows, names), *proved(rows, names)]


def pressed(rows, names):
    """What `radiation` gains and costs against `surface`."""
    known = {(row["scene"], row["method"]): row for row in rows}
    error, mean = ({key: float(row[metric]) for key, row in known.items()} for metric in ("relative_error_radiation", "relative_error"))
    outside = {method: ", ".join(percent(float(known[name, method]["abs_force_elsewhere_n"]) / float(known[name, method]["force_target_n"]), 0)
                                 for name in names) for method in ("surface", "radiation")}
    return (f"Skin is pressed by P. `radiation` minus `surface` is, in percentage points of the error of P: "
            f"{differences(error, names, 'radiation', 'surface')}; of the error of abs(p): {differences(mean, names, 'radiation', 'surface')}. "
            f"The sum of abs(P) A outside, over the force on the target, is in this order {outside['radiation']} with `radiation` and "
            f"{outside['surface']} with `surface`.")


def proved(rows, names):
    """Optimality gaps of `surface` and `radiation`, and the difference between the meshes. Empty if no run has an optimality bound."""
    known = {row["scene"]: row for row in rows if row["method"] == "surface"}
    bounded = [name for name in names if not math.isnan(float(known[name]["optimality_gap"]))]
    if not bounded:
        return []
    said = ("No choice of phases can lower the cost of `surface` by more than the optimality gap: "
            + ", ".join(f"{SCENES[name]} {percent(known[name]['optimality_gap'], 2)}" for name in bounded)
            + ". Method `radiation` has another cost; its gap is "
            + ", ".join(f"{SCENES[row['scene']]} {percent(row[gap_of(row)], 2)}" for row in rows
                        if row["method"] == "radiation" and row["scene"] in bounded)
            + ". This is proved for the computed matrix. It does not include the discretisation error.")
    evaluated = [name for name in bounded if not math.isnan(float(known[name]["evaluation_difference"]))]
    if evaluated:
        said += (" The pressures on the solving mesh and on the evaluation mesh differ, near the target and on all skin, by "
                 + ", ".join(f"{percent(known[name]['evaluation_difference_target'])} and "
                             f"{percent(known[name]['evaluation_difference'])} ({SCENES[name]})" for name in evaluated) + ".")
    return [said]
