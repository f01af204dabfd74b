"""Method `radiation` beside `surface`: outside weights, faults and starts."""

import math
import statistics

from runs import LABELS, results
from work import listed

WIDTHS = ["width_5mm", "width_8mm", "width_11mm"]
SCENES = [*WIDTHS, "penetration", "grasp"]
# The array moves in place of the hand, so that the same change suits every scene.
PLACES = {"as shipped": [], "150 mm": ["array.at_mm=[0,0,50]"], "300 mm": ["array.at_mm=[0,0,-100]"],
          "aside and tilted": ["array.at_mm=[20,10,0]", "array.rotate_deg=[10,0,0]"]}
WEIGHTS = ["0", "0.03", "0.05", "0.1", "0.2", "0.4", "0.8"]
WEIGHED = {"surface": ("surface", ""), "paper": ("paper", "")} | {f"radiation_{i}": ("radiation", weight) for i, weight in enumerate(WEIGHTS)}
TOLERANCES = "phase_deg: 20, gain_percent: 10"
DRAWS = range(1, 6)
# What is wrong: the changes of the scene, one list per draw.
FAULTS = {"as designed": [[]], "20 degrees, 10 %": [[f"array.tolerances={{{TOLERANCES}, seed: {seed}}}"] for seed in DRAWS],
          "5 % dead": [[f"array.tolerances={{dead_percent: 5, seed: {seed}}}"] for seed in DRAWS]}
FAULTS |= {f"{far} mm off along {axis}": [[f"sensing.offset_mm=[{far * sign if axis == 'x' else 0},0,{far * sign if axis == 'z' else 0}]"]
                                         for sign in (1, -1)] for axis in "xz" for far in (1, 2)}
COLUMNS = {"error": "relative_error_radiation", "error_abs_p": "relative_error", "width_mm": "width_radiation_mm",
           "width_wanted_mm": "width_wanted_mm", "length_mm": "length_radiation_mm", "length_wanted_mm": "length_wanted_mm",
           "force_n": "force_target_n", "outside_n": "abs_force_elsewhere_n", "loudest": "loudest_elsewhere",
           "reached": "reached_share", "seconds": "seconds_solve"}


def weight(work):
    """One step of each method runs first and computes what all share, so that the seconds are those of the phases alone."""
    import panels

    once = ["{surface: {as: once_surface, iterations: 1, start: zero}}", "{radiation: {as: once_radiation, iterations: 1}}",
            "{paper: {as: once_paper, iterations: 1, faces: area}}"]
    radiation = [f"{{radiation: {{as: {name}, outside_weight: {of}}}}}" for name, (kind, of) in WEIGHED.items() if kind == "radiation"]
    folders = work.solved({(scene, place): (scene, changes) for scene in SCENES for place, changes in PLACES.items()},
                          changes=[listed(*once, "surface", "{paper: {faces: area}}", *radiation)])
    rows = []
    for (scene, place), folder in folders.items():
        known = results(folder)
        rows += [{"scene": scene, "place": place, "method": kind, "outside_weight": of} | {column: float(known[name][key]) for column, key in COLUMNS.items()}
                 for name, (kind, of) in WEIGHED.items()]
    panels.figure({scene: folders[scene, "as shipped"] for scene in WIDTHS}, work.images / "radiation.png", panels.RADIATION,
                  {"paper": LABELS["paper"], "surface": LABELS["surface"], f"radiation_{WEIGHTS.index('0.1')}": LABELS["radiation"]})
    return {"radiation_weight": rows, "radiation_choice": choice(rows)}


def choice(rows):
    """Means over the cases. A box between several fingers has no width."""
    found = []
    for kind, of in WEIGHED.values():
        own = [row for row in rows if (row["method"], row["outside_weight"]) == (kind, of)]
        off = [abs(row["width_mm"] / row["width_wanted_mm"] - 1) for row in own if row["scene"] in WIDTHS and not math.isnan(row["width_mm"])]
        outside = [row["outside_n"] / row["force_n"] for row in own]
        found.append({"method": kind, "outside_weight": of, "cases": len(own),
                      **{column: statistics.mean(row[column] for row in own) for column in ("error", "error_abs_p", "force_n", "outside_n")},
                      "width_off": statistics.mean(off), "width_off_worst": max(off), "outside_share": statistics.mean(outside),
                      "outside_share_worst": max(outside), "loudest": statistics.mean(row["loudest"] for row in own),
                      "loudest_worst": max(row["loudest"] for row in own)})
    return found


def robust(work):
    """Mean and standard deviation over the draws; of a misplacement over both directions."""
    folders = work.solved({(scene, fault, draw): (scene, changes) for scene in WIDTHS for fault, draws in FAULTS.items() for draw, changes in enumerate(draws, 1)},
                          changes=[listed("surface", "radiation", f"{{radiation: {{as: radiation_tolerances, tolerances: {{{TOLERANCES}}}}}}}")])
    draws = {}
    for (scene, fault, _), folder in folders.items():
        for method, known in results(folder).items():
            draws.setdefault((scene, method, fault), []).append(known)

    def spread(values):
        return statistics.stdev(values) if len(values) > 1 else math.nan

    rows = []
    for (scene, method, fault), known in draws.items():
        error, width, force = ([float(one[key]) for one in known] for key in ("relative_error_radiation", "width_radiation_mm", "force_target_n"))
        rows.append({"scene": scene, "method": method, "fault": fault, "draws": len(known), "error": statistics.mean(error), "error_spread": spread(error),
                     "width_mm": statistics.mean(width), "width_spread_mm": spread(width), "width_wanted_mm": float(known[0]["width_wanted_mm"]),
                     "force_n": statistics.mean(force)})
    return {"radiation_robust": rows}


def starts(work):
    """The cost is relative to the least of the scene."""
    folders = work.solved({scene: (scene, []) for scene in WIDTHS}, changes=[listed(
        "{radiation: {as: automatic}}", *(f"{{radiation: {{as: random_{seed}, start: {{random: {seed}}}}}}}" for seed in range(1, 11)))])
    rows = []
    for scene, folder in folders.items():
        known = results(folder)
        least = min(one["costs"][-1] for one in known.values())
        rows += [{"scene": scene, "start": name, "cost": float(one["costs"][-1]), "above_least": float(one["costs"][-1] / least - 1), "steps": one["steps"],
                  "status": one["status"], "error": one["relative_error_radiation"], "width_mm": one["width_radiation_mm"]} for name, one in known.items()]
    return {"radiation_starts": rows}
