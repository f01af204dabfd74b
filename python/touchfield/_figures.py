"""Figures by matplotlib, ready for a paper, and the axes that plots and figures share."""

import io
import math

import matplotlib.figure
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle
from matplotlib.tri import Triangulation

from . import _core

_WIDTHS = {"single": 85, "double": 175}  # [mm], of a column of a journal and of its page
_STYLE = {"font.size": 8, "axes.titlesize": 7, "axes.labelsize": 8, "xtick.labelsize": 7, "ytick.labelsize": 7, "legend.fontsize": 7,
          "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6, "lines.linewidth": 1, "lines.markersize": 3.5,
          "savefig.dpi": 600, "pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}
# The lines of methods differ by dashes and markers too.
_COLOURS = ["#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"]
_DASHES = ["-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (3, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (2, 2))]
_MARKERS = "os^DvPX"


class Figure(matplotlib.figure.Figure):
    """A figure that is drawn and saved in the style of a paper, whatever the user's rcParams are."""

    def draw(self, renderer):
        with matplotlib.rc_context(_STYLE):
            super().draw(renderer)

    def savefig(self, fname, **options):
        with matplotlib.rc_context(_STYLE):
            super().savefig(fname, **options)

    def _repr_png_(self):
        content = io.BytesIO()
        self.savefig(content, format="png", dpi=200)
        return content.getvalue()


def _figure(width, height):
    """Of a height in mm."""
    if width not in _WIDTHS:
        raise _core.InputError(f"figure: width = {width!r} must be one of {', '.join(_WIDTHS)}")
    figure = Figure(figsize=(_WIDTHS[width] / 25.4, height / 25.4), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, wspace=0.01, hspace=0.01)
    return figure


def _quantity(name, values):
    """The label of a column of results, and its values in the unit that the label says."""
    unit = _core._metric_units.get(name) or {"s": "s", "m": "m"}.get(name.rpartition("_")[2], "1")
    if "." in name or unit == "1":
        return name if "." in name else name.replace("_", " "), values
    words = name.removesuffix("_" + unit.lower()).replace("_", " ")
    shown, factor = {"%": ("%", 100), "m": ("mm", 1e3), "N": ("mN", 1e3)}.get(unit, (unit, 1))
    return f"{words} [{shown}]", factor * np.asarray(values)


def lines(groups, ax, x, y):
    """A line of each group: its name and the columns x and y."""
    import matplotlib.pyplot as plt

    ax = plt.figure().add_subplot() if ax is None else ax
    for number, (name, along, up) in enumerate(groups):
        style = number % len(_COLOURS)
        xlabel, along = _quantity(x, along)
        ylabel, up = _quantity(y, up)
        ax.plot(along, up, color=_COLOURS[style], linestyle=_DASHES[style], marker=_MARKERS[style],
                markevery=max(1, len(along) // 12), label=name)
        ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.legend()
    return ax


@matplotlib.rc_context(_STYLE)
def panels(rows, columns, width, plot):
    """Plots in rows and columns with one legend; `plot` draws one of them in Axes."""
    height = _WIDTHS.get(width, 0) / columns * (0.6 if rows == 1 else 0.4)
    figure = _figure(width, 10 + rows * min(60, max(30, height)))
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey="row")
    for place, ax in np.ndenumerate(axes):
        plot(ax, *place)
        ax.get_legend().remove()
        ax.label_outer()
    figure.align_ylabels()
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=min(len(names), 3 if width == "single" else 6), frameon=False)
    return figure


def _pieces(sides):
    """The corners of the triangles into which lines cut one whose sides they cut into as many parts: (S, 3, 3) weights."""
    triangles = [[(i, j), (i + 1, j), (i, j + 1)] for i in range(sides) for j in range(sides - i)]
    triangles += [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(sides) for j in range(sides - 1 - i)]
    u, v = np.moveaxis(np.array(triangles) / sides, 2, 0)
    return np.stack([1 - u - v, u, v], axis=2)


_PIECES = _pieces(4)


class _Skin:
    """A mesh as an array sees it that faces along `sight`: x to the right, y up, and the distance [m]."""

    def __init__(self, mesh, sight):
        up = np.eye(3)[1 if abs(sight[1]) < 0.99 else 0]
        up = up - (up @ sight) * sight
        up /= np.linalg.norm(up)
        self.mesh, self.frame = mesh, np.array([np.cross(sight, up), up, sight])
        self.places = self.seen(mesh.vertices)
        facing = -(mesh.normals @ sight)
        self.front = facing > 0
        distance = self.places[mesh.triangles, 2].mean(axis=1)
        self.order = np.flatnonzero(self.front)[np.argsort(-distance[self.front])]  # farthest first
        self.light = 0.85 + 0.15 * abs(facing)

    def seen(self, points):
        return points @ self.frame.T

    def _at_vertices(self, values):
        """Means of faces by their areas."""
        def sums(weights):
            return np.bincount(self.mesh.triangles.ravel(), np.repeat(weights, 3), len(self.places))

        return sums(self.mesh.areas * values) / sums(self.mesh.areas)

    def _hidden(self, points):
        """Whether a face is nearer than each of these, as seen."""
        a, b, c = (self.places[self.mesh.triangles[self.order, corner]] for corner in range(3))
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        hidden = np.zeros(len(points), bool)
        for i, (x, y, distance) in enumerate(points):
            near = np.flatnonzero((low[:, 0] <= x) & (x <= high[:, 0]) & (low[:, 1] <= y) & (y <= high[:, 1]) & (low[:, 2] < distance))
            side, other, way = b[near] - a[near], c[near] - a[near], np.array([x, y, 0]) - a[near]
            area = side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0]
            u = (way[:, 0] * other[:, 1] - way[:, 1] * other[:, 0]) / area
            v = (side[:, 0] * way[:, 1] - side[:, 1] * way[:, 0]) / area
            depth = a[near, 2] + u * side[:, 2] + v * other[:, 2]
            hidden[i] = ((u >= 0) & (v >= 0) & (u + v <= 1) & (depth < distance - 1e-6)).any()
        return hidden

    def visible(self, ends):
        """Those of some lines (L, 2, 3) that no face hides, (L, 2, 2)."""
        return ends[~self._hidden(ends.mean(axis=1)), :, :2]

    def contour(self):
        """The lines between skin that is seen and skin that looks away."""
        edges = np.sort(self.mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, number = np.unique(edges, axis=0, return_inverse=True)
        return self.visible(self.places[edges[np.bincount(number.ravel(), np.repeat(self.front, 3)) == 1]])

    def draw(self, ax, values, colours):
        """A number of each face, smoothed, by colour; skin that is slanted is darker."""
        corners = self.mesh.triangles[self.order]
        parts = np.dstack([self.places[corners, :2], self._at_vertices(values)[corners], self._at_vertices(self.light)[corners]])
        # The colours of corners are blended. Where they differ much, their values must be, so such faces are cut.
        steep = np.ptp(colours.norm(parts[:, :, 2]).clip(0, 1), axis=1) > 0.05
        cut = np.einsum("scw,twx->tscx", _PIECES, parts[steep]).reshape(-1, 3, 4)
        order = np.argsort(np.concatenate([np.flatnonzero(~steep), np.repeat(np.flatnonzero(steep), len(_PIECES))]), kind="stable")
        x, y, levels, light = np.concatenate([parts[~steep], cut])[order].reshape(-1, 4).T
        rgba = colours.to_rgba(levels)
        rgba[:, :3] *= light[:, None]
        mesh = Triangulation(x, y, np.arange(len(x)).reshape(-1, 3))
        ax.add_collection(TriMesh(mesh, facecolors=rgba, rasterized=True), autolim=False)

    def draw_pieces(self, ax, corners, faces, values, colours):
        """Triangles (T, 3, 3) of faces, each of one colour."""
        places = self.seen(corners)
        shown = self.front[faces] & ~self._hidden(places.mean(axis=1))
        rgba = colours.to_rgba(values)
        rgba[:, :3] *= self.light[faces][:, None]
        ax.add_collection(PolyCollection(places[shown, :, :2], facecolors=rgba[shown], linewidth=0, antialiased=False, rasterized=True),
                          autolim=False)


class _Target:
    """The target of a run on the skin that is seen."""

    def __init__(self, skin, drawing, square):
        target = drawing["target"]
        self.faces = target.faces
        wanted = np.zeros(len(skin.mesh))
        wanted[self.faces] = square * target.amplitudes**2 if square else target.amplitudes
        self.corners = skin.places[skin.mesh.triangles[self.faces], :2].reshape(-1, 2)
        self.outline = skin.visible(skin.seen(drawing["outline"].reshape(-1, 2, 3)))
        cut = np.asarray(drawing["cut_faces"], int)
        whole = np.setdiff1d(self.faces, cut)
        self.pieces = (np.concatenate([drawing["cut_corners"].reshape(-1, 3, 3), skin.mesh.vertices[skin.mesh.triangles[whole]]]),
                       np.concatenate([cut, whole]))
        self.wanted = wanted[self.pieces[1]]


def _values(run, methods, quantity):
    """Of the faces of the evaluated skin by method, which quantity, and its unit."""
    unknown = [name for name in methods or [] if name not in run.methods]
    if unknown:
        raise _core.InputError(f"figure: there is no method '{unknown[0]}', there are {', '.join(run.methods)}")
    if quantity not in (None, "radiation", "pressure"):
        raise _core.InputError(f"figure: quantity = {quantity!r} must be radiation or pressure")
    names = methods or run.methods
    faces = len(run.mesh if run.evaluation_mesh is None else run.evaluation_mesh)
    radiation = {name: run.radiation[name] for name in names if len(run.radiation[name])}
    pressure = {name: abs(run.evaluation_pressures[name] if run.evaluation_mesh is not None else run.pressures[name]) for name in names}
    kind = quantity or ("radiation" if len(radiation) == len(names) else "pressure")
    values = {name: part for name, part in (radiation if kind == "radiation" else pressure).items() if len(part) == faces}
    if not values:
        what = "radiation pressure" if kind == "radiation" else "pressure"
        raise _core.InputError(f"figure: the run has no {what} on the evaluated skin")
    return values, kind


def _box(points, shape, share):
    """The middle and half of the sides of a view that holds points; `shape`: the least and the most height over width."""
    low, high = points.min(axis=0), points.max(axis=0)
    across, up = (high - low) / 2 / share
    aspect = min(max(up / across, shape[0]), shape[1])
    across = max(across, up / aspect)
    return (low + high) / 2, np.array([across, across * aspect])


def _views(skin, target, side, whole):
    """The body, and where it would be small the surroundings of the target, in panels that are `side` mm wide."""
    most = min(1.6, 75 / side)
    body = _box(skin.places[:, :2], (0.5 * most, most), 0.94)
    close = target and _box(target.corners, (min(1, most),) * 2, 0.6)
    if not target or close[1][0] > 0.6 * body[1][0]:
        return [body]
    return [body, close] if whole else [close]


def _scale_bar(ax, middle, half):
    most = 0.6e3 * half[0]  # [mm]
    length = 10 ** math.floor(math.log10(most))
    length *= max(step for step in (1, 2, 5) if step * length <= most)
    x, y = middle + half * [-0.92, 0.92]
    ax.plot([x, x + 1e-3 * length], [y, y], color="black", linewidth=1.5, solid_capstyle="butt", scalex=False, scaley=False)
    ax.annotate(f"{length:g} mm", (x, y), (0, -2), textcoords="offset points", fontsize=7, verticalalignment="top")


def _title(name, error, side):
    """Of a panel that is `side` mm wide: a long name has two lines."""
    if 1.25 * len(name) > side:
        name = "\n".join(name.rsplit("_", 1))
    return name + ("" if math.isnan(error) else f"\nerror {100 * error:.1f} %")


@matplotlib.rc_context(_STYLE)
def of_run(run, methods, quantity, width, whole, top, cmap):
    values, kind = _values(run, methods, quantity)
    presses = kind == "radiation"
    unit, divisor = ("Pa", 1) if presses else ("kPa", 1e3)
    drawing = run._drawing()
    skin = _Skin(run.mesh if run.evaluation_mesh is None else run.evaluation_mesh, drawing["sight"])
    target = _Target(skin, drawing, drawing["radiation_per_square"] if presses else None) if "target" in drawing else None
    errors = {name: run.metrics[name]["relative_error_radiation" if presses else "relative_error"] for name in values}

    wanted = target.wanted.max() if target else 0
    if top is None:  # one loud face must not darken all others, nor a method the rest
        top = max(np.quantile(part, 0.995) for part in values.values())
        top = min(max(top, wanted), 2 * wanted) if target else top
    colours = ScalarMappable(Normalize(0, top / divisor), cmap)

    names = ([None] if target else []) + list(values)  # None: what is wanted
    room = _WIDTHS.get(width, 0) - 14  # [mm], beside the colour bar
    groups = math.ceil(len(names) / max(room // 20, 1))
    across = math.ceil(len(names) / groups)
    side = room / across
    views = _views(skin, target, side, whole)
    heights = [side * half[1] / half[0] for _, half in views] * groups
    figure = _figure(width, sum(heights) + 7 * groups + 1)
    axes = figure.subplots(len(heights), across, squeeze=False, gridspec_kw={"height_ratios": heights})
    contour = skin.contour()
    for (row, column), ax in np.ndenumerate(axes):
        number = row // len(views) * across + column
        if number >= len(names):
            ax.axis("off")
            continue
        name, (middle, half) = names[number], views[row % len(views)]
        _draw_skin(ax, skin, target, values.get(name), colours, divisor)
        ax.add_collection(LineCollection(contour, colors="0.25", linewidths=0.3, capstyle="round"), autolim=False)
        (left, low), (right, high) = middle - half, middle + half
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal", xticks=[], yticks=[])
        if column == 0:
            _scale_bar(ax, middle, half)
        if row % len(views) == 0:
            ax.set_title(f"wanted\n{wanted / divisor:.3g} {unit}" if name is None else _title(name, errors[name], side), pad=3)
            for centre, size in views[1:]:
                ax.add_patch(Rectangle(centre - size, *(2 * size), fill=False, linewidth=0.5))
    below = min(part.min() for part in values.values()) < -0.02 * top
    above = max(part.max() for part in values.values()) > top
    figure.colorbar(colours, ax=axes, aspect=sum(heights) / 3, pad=0.02, label=f"{'radiation' if presses else 'sound'}\npressure [{unit}]",
                    extend={(0, 0): "neither", (0, 1): "max", (1, 0): "min", (1, 1): "both"}[below, above])
    return figure


def _draw_skin(ax, skin, target, values, colours, divisor):
    """The values of a method, or without them what the target wants."""
    skin.draw(ax, np.zeros(len(skin.mesh)) if values is None else values / divisor, colours)
    if target and values is None:
        skin.draw_pieces(ax, *target.pieces, target.wanted / divisor, colours)
    if target:
        for colour, width in (("white", 1.4), ("black", 0.6)):
            ax.add_collection(LineCollection(target.outline, colors=colour, linewidths=width, capstyle="round"), autolim=False)


@matplotlib.rc_context(_STYLE)
def of_felt(felt, width):
    """Rows of methods; columns of P and of the displacement of each skin, with one scale each."""
    skins = [("none", "P, rms [Pa]", 1)] + [(skin, f"{skin}, rms [\u00b5m]", 1e6) for skin in felt.skins if skin != "none"]
    side = _WIDTHS.get(width, 0) / len(skins)
    figure = _figure(width, len(felt.methods) * (side - 2) + 14)
    axes = figure.subplots(len(felt.methods), len(skins), squeeze=False, sharex=True, sharey=True)
    for column, (skin, label, factor) in enumerate(skins):
        maps = [factor * felt[method, skin].displacement for method in felt.methods]
        colours = ScalarMappable(Normalize(0, max(np.nanmax(part) for part in maps)), "YlGnBu")
        for ax, part in zip(axes[:, column], maps):
            along = np.linspace(-12, 12, len(part))  # [mm]
            ax.pcolormesh(along, along, part, norm=colours.norm, cmap=colours.cmap, rasterized=True)
            ax.contour(along, along, part, [0.5 * np.nanmax(part)], colors="black", linewidths=0.6)
            ax.plot(*(1e3 * np.array([point.place for point in felt.points[1:]]).reshape(-1, 2).T), "+", color="0.25", markeredgewidth=0.6)
            ax.set(aspect="equal", xticks=[-10, 0, 10], yticks=[-10, 0, 10])
        figure.colorbar(colours, ax=axes[:, column], location="top", aspect=12, pad=0.02, label=label)
    for method, ax in zip(felt.methods, axes[:, 0]):
        ax.set_ylabel(method)
    figure.supxlabel("on the patch [mm]", fontsize=8)
    return figure
