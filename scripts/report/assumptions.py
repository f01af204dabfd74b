"""Effects of assumptions that the published study leaves open, one change at a time."""

import json

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from runs import LABELS, STYLES, number, percent, table  # noqa: E402

METHODS = ["surface", "paper", "unscattered", "focus"]


def in_words(row, inputs):
    """Describes the change of a case."""
    said = []
    for key in inputs:
        value = row[key]
        if value == "":
            continue
        if key == "body.place.at_mm":
            x, _, z = json.loads(value)
            said.append(f"{abs(x):g} mm beside the array's axis" if x else f"height {z:g} mm")
        elif key == "body.place.rotate_deg":
            said.append(f"finger turned by {json.loads(value)[0]:g} degrees about x")
        elif key == "medium.temperature_c":
            said.append(f"air at {value} C")
        elif key == "target.pressure_pa":
            said.append(f"wanted pressure {float(value) / 1e3:g} kPa")
        elif key == "target.box.size_mm":
            said.append("box {} x {} x {} mm".format(*json.loads(value)))
        elif key == "array":
            said.append("six AUTD3 units, 1,494 transducers" if "autd3" in value else
                        "directivity " + value.split("directivity: ")[1].strip("} "))
        elif key == "body.hand":
            breadth = value.split("breadth_mm: ")[1].split(",")[0]
            said.append(f"hand {breadth} mm broad")
        elif key == "body.edge_mm":
            said.append(f"edges of {value.split('near_target: ')[1].split(',')[0]} mm near the target")
        else:
            said.append(f"{key} {value}")
    return ", ".join(said)


def read(folder):
    """[(change, {method: row})] of the cases of a sweep, with the unchanged scene first."""
    rows = [row for row in table(folder / "sweep.csv") if row["status"] == "ok"]
    columns = list(rows[0])
    inputs = columns[columns.index("status") + 1:columns.index("name")]
    found = {}
    for row in rows:
        found.setdefault(int(row["case"]), (in_words(row, inputs), {}))[1][row["method"]] = row
    ordered = [found[case] for case in sorted(found)]
    return [(f"as shipped ({ordered[0][0]})", ordered[0][1]), *sorted(ordered[1:], key=lambda item: item[0])]


def figure(changes, path):
    drawing, (left, right) = pyplot.subplots(1, 2, figsize=(13, 0.8 + 0.33 * len(changes)), layout="constrained",
                                             sharey=True)
    places = list(range(len(changes)))[::-1]
    for method in METHODS:
        style = {key: STYLES[method][key] for key in ("color", "marker")} | {"linestyle": "none"}
        left.plot([100 * float(known[method]["relative_error"]) for _, known in changes], places, **style,
                  label=LABELS[method])
        right.plot([float(known[method]["width_mm"]) for _, known in changes], places, **style)
    left.set_yticks(places, [what for what, _ in changes])
    left.set_xlabel("evaluated error [%]")
    right.set_xlabel("full width at half maximum of |p|^2 [mm]")
    right.axvline(float(changes[0][1]["surface"]["width_wanted_mm"]), color="red", linewidth=0.9)
    for axes in (left, right):
        axes.grid(axis="y", color="0.9")
        axes.set_axisbelow(True)
    left.legend(fontsize=9)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)


def summary(changes):
    """Header and rows: evaluated error of each method, effect of scattering in the solver, width. The header names CSV columns too."""
    header = ["what changes", *(f"`{method}`" for method in METHODS), "`paper` - `unscattered` [points]",
              "width by `surface` / `paper` / `unscattered` [mm]"]
    rows = []
    for what, known in changes:
        difference = float(known["paper"]["relative_error"]) - float(known["unscattered"]["relative_error"])
        rows.append([what, *(percent(known[method]["relative_error"]) for method in METHODS),
                     f"{100 * difference:+.1f}",
                     " / ".join(number(known[method]["width_mm"], 2) for method in METHODS[:3])])
    return header, rows


def sentences(changes):
    def gain(known):
        return float(known["unscattered"]["relative_error"]) - float(known["paper"]["relative_error"])

    gains = [(gain(known), what) for what, known in changes]
    base = changes[0][1]
    errors = [(float(known["surface"]["relative_error"]), what) for what, known in changes]
    worse = [what for value, what in gains if value <= 0]
    said = [f"In the scene as shipped, scattering in the solver lowers the evaluated error by {100 * gain(base):.1f} percentage points. "
            f"Over all changes, the reduction is {100 * min(gains)[0]:.1f} ({min(gains)[1]}) to {100 * max(gains)[0]:.1f} "
            f"({max(gains)[1]}) points."]
    said.append("Scattering in the solver lowers the error in all cases." if not worse else
                "Scattering in the solver does not lower the error with: " + "; ".join(worse) + ".")
    said.append(f"The error of `surface` is {percent(min(errors)[0])} ({min(errors)[1]}) to {percent(max(errors)[0])} "
                f"({max(errors)[1]}).")
    return said
