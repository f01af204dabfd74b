"""What skin does under circling and modulated spots: felt_modulation.csv, felt_speed.csv and two pictures for docs/felt.md.

`circle` is a spot of 8 mm that goes round a circle in 40 frames, `rest` the same spot in the middle, with a sound that goes from 0 to 1
and back. Lines up to 20 times the frequency of a circle count, so that its steps do not.

All figures are at a largest radiation pressure P of 100 Pa over skin and time: displacement is linear in P. At equal drive `drive_db` is to
be added to the columns _db. These are circle minus rest, of the largest value over the skin; p_patch has the sum of squares instead. The
columns _range are over all skins. rest_p_over_200hz_db compares the spot at rest with itself at 200 Hz.
"""

import functools
import itertools
import math

import h5py
import numpy
from runs import table
from work import ROOT, sets

FRAMES = 40  # of a turn or period
HIGHEST = 2000  # that the program allows [Hz]
PEAK = 100.0  # [Pa]
FREQUENCIES = [10, 30, 50, 100, 200]
SPEEDS = [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20]  # [m/s]
SKINS = {"soft": ("#0072B2", "o"), "middle": ("#009E73", "s"), "stiff": ("#D55E00", "^"), "none": ("#000000", "x")}
# Column: dataset of felt.h5, dB per decade. The figure p_patch is made here.
FIGURES = {"displacement": ("displacement", 20), "velocity": ("velocity", 20), "energy": ("energy_pc", 10), "p": ("weighted_p", 20), "ra": ("weighted_ra", 20)}
UNITS = {"displacement_um": ("displacement", 1e6), "velocity_mm_s": ("velocity", 1e3), "energy_pc_j_m3": ("energy", 1)}
COMMON = ["body.hand.forearm_mm=0", "body.edge_mm={near_target: 1.4, far: 7, within_mm: 15}", "pattern.watch=[]", "target.pressure_pa=9600",
          "felt.at_mm=[0, 0, 200]", "pattern.diameter_mm=8", f"pattern.frames_per_second={100 * FRAMES}"]
PALM = ["body.hand.pose=flat", "body.place={landmark: palm_centre, at_mm: [0, 0, 200]}", "pattern.circle.at=palm_centre",
        "target.box={at: palm_centre, size_mm: [12, 12, 20]}"]
BONE_4, NO_END, LESS_LOSS, BONE_12 = "4 mm on bone", "without end", "without end, loss 0.2", "12 mm on bone"
LAYERS = {BONE_4: ["felt.layers=on_bone", "felt.bone_mm=4"], NO_END: ["felt.layers=half_space"],
          LESS_LOSS: ["felt.layers=half_space", "felt.tan_delta=0.2"], BONE_12: ["felt.layers=on_bone", "felt.bone_mm=12"]}
# Place: changes of the scene, radii [mm] and layers of circles against spots at rest, then of circles by speed.
PLACES = {"fingertip": ([], [3, 5], [BONE_4], [3, 5], [BONE_4]),
          "palm": (PALM, [3, 5], [NO_END, BONE_12], [5, 8], [NO_END, LESS_LOSS, BONE_12]),
          "fingertip, 20 x 18 channels": (["array.grid.count=[20, 18]"], [3], [BONE_4], [], [])}


class Study:
    """Patterns that were solved, and what skins do under them. Radius 0 is the spot at rest."""

    def __init__(self, work):
        self.work = work
        radii = {place: sorted({0, *own, *others}) for place, (_, own, _, others, _) in PLACES.items()}
        self.patterns = work.solved({(place, radius): ("circle", [*PLACES[place][0], *(
            [f"pattern.circle.radius_mm={radius}"] if radius else ["pattern.circle.radius_mm=0.1", "pattern.amplitude={hz: 100}"])])
            for place, own in radii.items() for radius in own}, "pattern", COMMON)
        self.felt = functools.cache(self.felt)

    def pressures(self, place, radius):
        """P of each frame on the faces of the patch [Pa], and their areas [m2]."""
        with h5py.File(self.patterns[place, radius] / "pattern.h5") as file:
            return file["patch/radiation"][:], file["mesh/area"][:][file["patch/faces"][:]]

    def peak(self, place, radius):
        return float(self.pressures(place, radius)[0].max())

    def spot_mm2(self, place):
        """Where P is at least half of its largest."""
        pressure, area = self.pressures(place, 0)
        loudest = pressure[pressure.max(axis=1).argmax()]
        return float(1e6 * area[loudest >= 0.5 * loudest.max()].sum())

    def felt(self, place, layers, radius, hz):
        """{skin: {figure: value}} at a largest P of PEAK."""
        factor, lines = PEAK / self.peak(place, radius), FRAMES // 2 if radius > 0 else 2
        changes = [*LAYERS[layers], f"felt.frames_per_second={FRAMES * hz:.10g}", f"felt.highest_hz={min(HIGHEST, lines * hz):.10g}"]
        self.work.call("felt", self.patterns[place, radius], "-o", self.work.runs / "felt", "--force", "--quiet", *sets(changes))
        found = {}
        with h5py.File(self.work.runs / "felt/felt.h5") as file:
            method, = file["methods"].values()
            for skin in SKINS:
                maps = {figure: (factor**2 if per_decade == 10 else factor) * method["skins"][skin][part][:]
                        for figure, (part, per_decade) in FIGURES.items() if part in method["skins"][skin]}
                found[skin] = {"energy": numpy.nan, **{figure: float(numpy.nanmax(values)) for figure, values in maps.items()},
                               "p_patch": float(numpy.nansum(maps["p"]**2)**0.5)}
        return found


def decibels(values, reference, figure):
    """NaN where a channel has no lines."""
    value, other = values[figure], reference[figure]
    return FIGURES.get(figure, FIGURES["p"])[1] * math.log10(value / other) if value > 0 and other > 0 else math.nan


def absolute(values, skin, prefix=""):
    return {prefix + column: math.nan if skin == "none" else unit * values[figure] for column, (figure, unit) in UNITS.items()}


def spread(values):
    """The range of dB over all skins, and whether the order depends on the skin."""
    values = [value for value in values if value == value]
    if not values:
        return "-"
    both = f"{min(values):+.1f} to {max(values):+.1f}"
    return both if min(values) > 0 or max(values) < 0 else f"{both}: depends"


def modulation(study):
    rows = []
    for place, (_, radii, tissues, _, _) in PLACES.items():
        for layers, radius, hz in itertools.product(tissues, radii, FREQUENCIES):
            circle, rest, at_200 = (study.felt(place, layers, *which) for which in ((radius, hz), (0, hz), (0, 200)))
            peak, rest_peak = study.peak(place, radius), study.peak(place, 0)
            of_all = {"soft_over_stiff_db": decibels(circle["soft"], circle["stiff"], "displacement"), "drive_db": 20 * math.log10(peak / rest_peak),
                      "circle_peak_pa": peak, "rest_peak_pa": rest_peak, "spot_mm2": study.spot_mm2(place)}
            gains = {skin: {figure: decibels(circle[skin], rest[skin], figure) for figure in (*FIGURES, "p_patch")} for skin in SKINS}
            of_all |= {f"{figure}_range": spread([gain[figure] for gain in gains.values()]) for figure in gains["none"]}
            rows += [{"place": place, "layers": layers, "radius_mm": radius, "hz": hz, "skin": skin,
                      **absolute(circle[skin], skin, "circle_"), **absolute(rest[skin], skin, "rest_"),
                      "rest_p_over_200hz_db": decibels(rest[skin], at_200[skin], "p"),
                      **{f"{figure}_db": gain for figure, gain in gains[skin].items()}, **of_all} for skin in SKINS]
    return rows


def speed(study):
    """The columns _db are relative to the best speed on the same skin."""
    rows = []
    for place, (_, _, _, radii, tissues) in PLACES.items():
        for layers, radius in itertools.product(tissues, radii):
            length = 2e-3 * math.pi * radius
            found = {speed: study.felt(place, layers, radius, speed / length) for speed in SPEEDS}
            for skin in SKINS:
                best = {figure: max(values[skin][figure] for values in found.values()) for figure in FIGURES}
                rows += [{"place": place, "layers": layers, "radius_mm": radius, "skin": skin, "speed_m_s": speed, "hz": speed / length,
                          **absolute(values[skin], skin), **{f"{figure}_db": decibels(values[skin], best, figure) for figure in FIGURES}}
                         for speed, values in found.items()]
    return rows


def tables(work):
    study = Study(work)
    return {name: [{key: ("" if value != value else f"{value:.5g}") if isinstance(value, float) else value for key, value in row.items()} for row in rows]
            for name, rows in (("felt_modulation", modulation(study)), ("felt_speed", speed(study)))}


def pictures(images):
    """Both tables as curves: a column per place and layers, a colour per skin."""
    from matplotlib import pyplot

    def draw(rows, x, quantities, label, styles):
        columns = list(dict.fromkeys((row["place"], row["layers"]) for row in rows if row["place"] in ("fingertip", "palm")))
        figure, axes = pyplot.subplots(2, len(columns), figsize=(10, 5.6), sharex=True, sharey="row", layout="constrained")
        for (quantity, title), line in zip(quantities, axes):
            line[0].set_ylabel(title)
            for column, panel in zip(columns, line):
                panel.axhline(0, color="#888888", linewidth=0.8, zorder=0)
                panel.grid(alpha=0.25)
                here = [row for row in rows if (row["place"], row["layers"]) == column and row[quantity]]
                for (radius, style), (skin, (colour, marker)) in itertools.product(styles.items(), SKINS.items()):
                    points = [(float(row[x]), float(row[quantity])) for row in here if (row["radius_mm"], row["skin"]) == (radius, skin)]
                    if points:
                        panel.plot(*zip(*points), style, color=colour, marker=marker, markersize=4, linewidth=1.3, label=f"{skin}, {radius} mm")
        for (place, layers), top, bottom in zip(columns, *axes):
            top.set_title(f"{place}, {layers}", fontsize=9)
            bottom.set_xlabel(label)
        shown = dict(zip(*reversed(axes[0, 0].get_legend_handles_labels()))) | dict(zip(*reversed(axes[0, -1].get_legend_handles_labels())))
        figure.legend(shown.values(), shown.keys(), loc="upper center", bbox_to_anchor=(0.5, 0), ncols=8, fontsize=8, frameon=False)
        return figure, axes

    perceived, moved = ("p_db", "Pacinian weighting [dB]"), ("displacement_db", "displacement [dB]")
    tables = ROOT / "results/tables"
    figure, axes = draw(table(tables / "felt_modulation.csv"), "hz", [perceived, moved], "frequency [Hz]", {"3": "-", "5": "--"})
    axes[0, 0].set_xscale("log")
    axes[0, 0].set_xticks(FREQUENCIES, FREQUENCIES)
    axes[0, 0].minorticks_off()
    figure.savefig(images / "felt_modulation.png", dpi=90, bbox_inches="tight")
    speeds = [row for row in table(tables / "felt_speed.csv") if row["radius_mm"] == {"fingertip": "5", "palm": "8"}[row["place"]]]
    figure, _ = draw(speeds, "speed_m_s", [moved, perceived], "draw speed [m/s]", {"5": "--", "8": "-"})
    figure.savefig(images / "felt_speed.png", dpi=90, bbox_inches="tight")
