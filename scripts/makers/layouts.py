"""Layouts of an array, compared by the errors of |p| and of radiation pressure that they reach, with phases alone and with amplitudes too.

A layout is a table of positions and axes. Each has at most 1,500 transducers of 10 mm. They do not overlap, and the centre of the
target is at least 20 mm away.
"""

import itertools
import math
import re
import shutil

import numpy as np
import scipy.spatial
from runs import table
from work import ROOT

MOST = 1500
PITCH = 10.16e-3  # [m], of transducers of 10 mm
CENTRE = np.array([0.0, 0.0, 0.2])  # of the target [m]
WIDTHS_OF = "60 kHz, radius 165 mm, 105 deg"  # it clears the hand by two wavelengths
PUBLISHED = "flat", "44 x 34, 200 mm"
FREE = "{{{}: {{as: with_amplitudes, free_amplitudes: true}}}}".format
COMMON = "base: base.yaml\nset:\n  field: []\n"
BEST, BEST_OF_40 = 6, 2  # by each measure, of which radiation pressure is solved too: of all, and of 40 kHz


def plate(nx, ny, distance, axis="x", tilt=0.0, pitch=PITCH):
    """A plate that faces the target from `distance`, its normal `tilt` degrees from the vertical."""
    x, y = ((np.arange(n) - (n - 1) / 2) * pitch for n in (nx, ny))
    points = np.array([(a, b, 0.0) for b in y for a in x])
    c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    turn = np.array({"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}[axis])
    return points @ turn.T + CENTRE - distance * turn[:, 2], np.tile(turn[:, 2], (len(points), 1))


def together(*plates):
    return np.vstack([points for points, _ in plates]), np.vstack([axes for _, axes in plates])


def cap(radius, most_degrees, count=MOST):
    """Part of a sphere about the target, from straight below to an angle, covered evenly (Fibonacci's spiral)."""
    i = np.arange(count) + 0.5
    z = 1 - (1 - math.cos(math.radians(most_degrees))) * i / count
    turn = math.pi * (1 + 5**0.5) * i
    s = np.sqrt(1 - z**2)
    out = np.stack([s * np.cos(turn), s * np.sin(turn), -z], axis=1)
    return CENTRE + radius * out, -out


def surround(radius, most_degrees, count):
    """A cap beyond the horizontal, without what is near the hand."""
    points, axes = cap(radius, most_degrees, count)
    clear = is_clear(points, 0.01)
    return points[clear], axes[clear]


def arc(radius, most_degrees, columns, rows, axis):
    """Part of a cylinder about the target: `columns` along the arc, `rows` along its axis (x or y)."""
    return together(*(plate(rows, 1, radius, "x", angle) if axis == "x" else plate(1, rows, radius, "y", -angle)
                      for angle in np.linspace(-most_degrees, most_degrees, columns)))


def spacing(points):
    return scipy.spatial.cKDTree(points).query(points, 2)[0][:, 1].min()


def all_layouts():
    """Family, what is varied, the layout, and the frequency [kHz]."""
    def mm(metres):
        return f"{1e3 * metres:.0f} mm"

    for (nx, ny), distance in itertools.product(((44, 34), (34, 44), (60, 25), (25, 60), (24, 24)), (0.06, 0.08, 0.1, 0.15, 0.2, 0.25, 0.3)):
        yield "flat", f"{nx} x {ny}, {mm(distance)}", plate(nx, ny, distance), 40
    for pitch, distance in itertools.product((13e-3, 20e-3), (0.1, 0.2, 0.3)):
        yield "sparse", f"pitch {mm(pitch)}, {mm(distance)}", plate(38, 38, distance, pitch=pitch), 40
    for radius, degrees, count in itertools.product((0.16, 0.2, 0.25, 0.3), (30, 45, 60, 70, 80, 88), (1500, 1000, 500)):
        yield "cap", f"radius {mm(radius)}, {degrees} deg, {count}", cap(radius, degrees, count), 40
    for radius, degrees, count in ((0.17, 100, 1500), (0.17, 120, 1600), (0.17, 140, 1600), (0.2, 120, 1580), (0.25, 120, 1580)):
        yield "surround", f"radius {mm(radius)}, {degrees} deg", surround(radius, degrees, count), 40
    for axis in "xy":
        for family, n, tilts, distances in (("two plates", 27, (30, 50, 70), (0.15, 0.2, 0.25)), ("three plates", 22, (50, 70), (0.18, 0.22))):
            for tilt, distance in itertools.product(tilts, distances):
                middle = [plate(n, n, distance)] if family == "three plates" else []
                yield family, f"turned about {axis} by {tilt} deg, {mm(distance)}", together(
                    *middle, *(plate(n, n, distance, axis, side) for side in (tilt, -tilt))), 40
    for tilt, distance in itertools.product((45, 75), (0.15, 0.2)):
        yield "five plates", f"{tilt} deg, {mm(distance)}", together(
            plate(17, 17, distance), *(plate(17, 17, distance, axis, sign * tilt) for axis in "xy" for sign in (1, -1))), 40
    for axis, radius, degrees in itertools.product("xy", (0.12, 0.2), (45, 85)):
        columns = int(math.radians(2 * degrees) * radius / PITCH)
        yield "arc", f"along {axis}, radius {mm(radius)}, {degrees} deg", arc(radius, degrees, columns, min(34, MOST // columns), axis), 40
    for frequency in (50, 60, 70, 80):
        yield f"{frequency} kHz", "44 x 34, 200 mm", plate(44, 34, 0.2), frequency
        for radius, degrees in ((0.18, 88), (0.2, 80), (0.22, 80)):
            yield f"{frequency} kHz", f"cap, radius {mm(radius)}, {degrees} deg", cap(radius, degrees), frequency
        yield f"{frequency} kHz", "surround, radius 170 mm, 140 deg", surround(0.17, 140, 1600), frequency
    # What the others lead to: as dense as they can be, beyond the horizontal, where three wavelengths span the target.
    for frequency, radius, degrees in ((60, 0.15, 120), (60, 0.165, 105), (60, 0.16, 120), (55, 0.15, 120), (65, 0.15, 120), (70, 0.15, 120)):
        yield "dense", f"{frequency} kHz, radius {mm(radius)}, {degrees} deg", surround(radius, degrees, 1600), frequency


def is_clear(points, more=0.0):
    """Of the hand, roughly. The program refuses transducers in the skin, with a forearm that is lower."""
    return (points[:, 2] < 0.185 - more) | (abs(points[:, 0]) > 0.085 + more) | (points[:, 1] > 0.04 + more)


def sound(points, axes):
    """Whether it can be built and clears the hand."""
    near = np.linalg.norm(points - CENTRE, axis=1).min()
    return len(points) <= MOST and spacing(points) >= 0.0099 and near >= 0.02 and is_clear(points).all()


def edges(frequency):
    """As fine for the wavelength as the base scene's are at 40 kHz."""
    return f"{{near_target: {1.2 * 40 / frequency:.3g}, far: {6.5 * 40 / frequency:.3g}, within_mm: 15}}"


def write_layouts(folder):
    """{number: layout}, and {number: its case in a sweep}."""
    rows, cases = {}, {}
    for family, name, (points, axes), frequency in all_layouts():
        if not sound(points, axes):
            continue
        number = len(rows) + 1
        np.savetxt(folder / f"layout_{number:03d}.csv", np.hstack([1e3 * points, axes]), "%.6g", ",", header="x_mm,y_mm,z_mm,nx,ny,nz", comments="")
        rows[number] = {"layout": number, "family": family, "name": name, "transducers": len(points),
                        "spacing_mm": round(1e3 * spacing(points), 2)}
        more = "" if frequency == 40 else f", frequency_khz: {frequency}, body.edge_mm: {edges(frequency)}"
        kind = "" if frequency == 40 else ", directivity: piston"  # the measured one is of 40 kHz
        cases[number] = (f"  - {{array: {{positions: {{file: layout_{number:03d}.csv}}{kind}}}{more}, "
                         f"solve.iterations: {150 if family == 'dense' else 60}}}\n")
    shutil.copy(ROOT / "scenes/width_8mm.yaml", folder / "base.yaml")  # names of files start from its folder
    return rows, cases


def swept(work, name, text):
    """Rows of the cases that ended well. A transducer in the hand ends its case only."""
    (work.runs / f"{name}.yaml").write_text(COMMON + text)
    try:
        work.call("sweep", work.runs / f"{name}.yaml", "-o", work.runs / name, "--jobs", work.jobs)
    except RuntimeError as error:
        print(error, flush=True)
    return [row for row in table(work.runs / name / "sweep.csv") if row["status"] == "ok"]


def designs(work):
    known, cases = write_layouts(work.runs)

    def of_layouts(name, text, numbers):
        """{number: {method: row}}"""
        found = {}
        for row in swept(work, name, text + "  write: [h5]\n  evaluation: same\ncases:\n" + "".join(cases[number] for number in numbers)):
            found.setdefault(int(re.search(r"layout_(\d+)[.]csv", row["array"])[1]), {})[row["name"]] = row
        return found

    def least(rows, error):
        return min(float(row[error]) for row in rows.values())

    solved = of_layouts("designs", f"  solve.methods: [surface, {FREE('surface')}]\n", cases)
    best = [number for number in solved if (known[number]["family"], known[number]["name"]) == PUBLISHED]
    for error in ("relative_error", "relative_error_radiation"):
        ranked = sorted(solved, key=lambda number: least(solved[number], error))
        best += ranked[:BEST] + [number for number in ranked if "frequency_khz" not in cases[number]][:BEST_OF_40]
    felt = of_layouts("radiation", f"  solve.methods: [radiation, {FREE('radiation')}]\n", dict.fromkeys(best))
    lines = [known[number] | {f"{short}_{name}": f"{float(row[key]):.4g}" for name, row in rows.items() for short, key in (
                 ("error", "relative_error_radiation"), ("width_mm", "width_radiation_mm"), ("power", "power_share"))}
             for number, rows in sorted(felt.items(), key=lambda item: least(item[1], "relative_error_radiation"))]
    number, = [number for number, row in known.items() if row["name"] == WIDTHS_OF]
    keys = ["relative_error_radiation", "width_radiation_mm", "force_target_n", "evaluation_difference", "power_share"]
    widths = [{"box_mm": row["target.box.size_mm"].strip("[]").replace(", ", " x ")} | {key: f"{float(row[key]):.5g}" for key in keys}
              for row in swept(work, "widths", (
                  "  write: [h5, png]\n  frequency_khz: 60\n"
                  f"  array: {{positions: {{file: layout_{number:03d}.csv}}, directivity: piston}}\n  solve.methods: [{FREE('radiation')}]\n"
                  "  body.edge_mm: {near_target: 0.8, far: 4.3, within_mm: 15}\n"
                  "  evaluation: {scheme: burton_miller_polished, edge_mm: {near_target: 0.67, far: 3, within_mm: 15}}\n"
                  "cases:\n" + "".join(f"  - {{target.box.size_mm: {box}}}\n" for box in ("[5, 12, 6]", "[8, 8, 6]", "[11, 6, 6]"))))]
    shutil.copy(work.runs / "widths/cases/00002/overview.png", work.images / "array_dense.png")
    return {"array_designs_best": lines, "array_widths": widths}
