"""Phase methods: on two shipped scenes, and on 60 drawn ones."""

import json
import math
import random
import re
import statistics

from runs import results, table
from work import listed

RANDOM = "{random: 1}"
METHODS = {  # label: (method, options)
    "`surface`": ("surface", "start: auto"),
    "`surface`, from zero": ("surface", "start: zero"),
    "`surface`, adjoint": ("surface", "start: adjoint"),
    "`surface`, spectral": ("surface", "start: spectral"),
    "`surface`, random": ("surface", f"start: {RANDOM}"),
    "`surface`, random, another seed": ("surface", "start: {random: 2}"),
    "`surface`, best of 8 random": ("surface", "start: {random: 1, restarts: 8}"),
    "`paper`, faces by area": ("paper", "start: zero, faces: area"),
    "`paper`, faces alike": ("paper", "start: zero"),
    "`unscattered`, faces by area": ("unscattered", "start: zero, faces: area"),
    "`unscattered`, faces alike": ("unscattered", "start: zero"),
    "`focus`": ("focus", ""),
    "`gs`": ("gs", "start: zero"),
    "`wgs`": ("wgs", "start: zero"),
    "`gs_pat`": ("gs_pat", ""),
    "`eigen`": ("eigen", ""),
    "`lbfgs`": ("lbfgs", "start: zero, iterations: 300"),
}
COLUMNS = ["relative_error", "optimality_gap", "width_mm", "leakage", "mean_inside_pa", "force_target_n", "seconds_solve",
           "cost_skin", "cost_bound", "evaluation_difference", "steps", "status"]
PRESSED = ["force_target_n", "abs_force_elsewhere_n", "loudest_elsewhere", "width_radiation_mm", "relative_error_radiation", "peak_radiation_pa"]


def named(name, method, options):
    return f"{{{method}: {{as: {name}{', ' * bool(options)}{options}}}}}"


def tables(work):
    """Methods that run first, for one step, compute what all share, so that the seconds are those of the phases alone."""
    once = [named(f"once_{method}", method, "iterations: 1, start: zero") for method in ("surface", "paper", "unscattered")]
    every = ["solve.optimality_bound=true", "solve.iterations=30", listed(*once, *(named(f"m{i}", *what) for i, what in enumerate(METHODS.values())))]
    starts = listed(*(named(name, "surface", f"start: {start}") for name, start in (("zero", "zero"), ("random", RANDOM), ("spectral", "spectral"))))
    forces = {pressure: ("width_8mm", ["solve.iterations=30", f"target.pressure_pa={pressure}", listed("surface", "radiation", "focus")])
              for pressure in (4800, 6800, 9600, 13600, 19200)}
    folders = work.solved({"width_8mm": ("width_8mm", every), "grasp": ("grasp", every),
                           "starts": ("width_8mm", ["evaluation=none", "solve.iterations=200", starts]), **forces})
    revision = re.search(r"\(([^)]+)\)", work.call("--version"))[1]
    made = {"phases_scenes": [], "phases_weights": []}
    for scene, kind in (("width_8mm", "strip"), ("grasp", "hand")):
        known = results(folders[scene])
        rows = {re.sub(r"\W+", "_", label).strip("_"): {"method": label} | {name: known[f"m{i}"][name] for name in COLUMNS} for i, label in enumerate(METHODS)}
        made[f"phases_{scene}"] = [{"key": key} | row for key, row in rows.items()]
        over = [rows[key]["force_target_n"] / rows["surface_random"]["force_target_n"] for key in ("focus", "gs", "gs_pat")]
        first = known["once_surface"]
        made["phases_scenes"].append({"scene": scene, "kind": kind} | {name: first[name] for name in ("faces", "channels", "target_faces")} | {
            "matrix_seconds": first["seconds_solve"], "least_force_ratio": min(over), "largest_force_ratio": max(over), "revision": revision})
        alike, by_area = (rows[f"paper_faces_{key}"]["relative_error"] - rows["surface"]["relative_error"] for key in ("alike", "by_area"))
        made["phases_weights"].append({"scene": scene, "alike_beyond": alike, "by_area_beyond": by_area, "share": 1 - by_area / alike, "revision": revision})
    costs = {name: known["costs"] for name, known in results(folders["starts"]).items()}
    # A start that has converged keeps its cost.
    made["phases_iterations"] = [{"scene": "8 mm", "start": name} | {f"after_{step}": cost[min(step, len(cost) - 1)] / costs["zero"][-1] - 1 for step in (10, 20, 30)}
                                 | {"revision": revision} for name, cost in costs.items()]
    made["phases_force"] = [{"scene": "width_8mm", "wanted_pa": pressure, "method": method} | {name: known[name] for name in PRESSED}
                            for pressure in forces for method, known in results(folders[pressure]).items()]
    return made


ARRAYS = [(16, 16), (24, 20), (32, 26), (44, 34)]
BODIES = ["capsule", "finger", "palm"]
PAYS = "gs"  # the first on the skin also pays for the transfer matrix; it lowers no such cost
COMPARED = [
    PAYS, "surface", {"surface": {"as": "surface_zero", "start": "zero"}}, {"surface": {"as": "surface_random", "start": {"random": 1}}},
    {"surface": {"as": "surface_adjoint", "start": "adjoint"}}, {"surface": {"as": "surface_spectral", "start": "spectral"}},
    {"surface": {"as": "surface_random_8", "start": {"random": 1, "restarts": 8}}}, {"lbfgs": {"iterations": 300}}]


def scene(number):
    """The scene of a number, its seed: 12 in a row hold every array under every body."""
    draw = random.Random(f"phases {number}")

    def between(low, high):
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    body = BODIES[number // len(ARRAYS) % len(BODIES)]
    height, pressure, width, length = between(40, 300), between(300, 15000), between(4, 40), between(4, 40)
    at = [-round(draw.uniform(-0.2, 0.2) * height, 1), round(draw.uniform(-0.2, 0.2) * height, 1), round(height, 1)]
    if body == "capsule":
        landmark = "bottom"
        shape = {"capsule": {"radius_mm": round(draw.uniform(6, 12), 1), "length_mm": round(draw.uniform(15, 40), 1)}, "edge_mm": 1.7}
    elif body == "finger":
        landmark = "index_pad"
        shape = {"hand": {"pose": "index_up"}, "edge_mm": {"near_target": 1.4, "far": 3, "within_mm": 15}, "keep_within_mm": 45}
    else:
        landmark = "palm_centre"
        shape = {"hand": {"pose": "flat"}, "edge_mm": {"near_target": 1.8, "far": 3, "within_mm": 20}, "keep_within_mm": 60}
    return {"name": f"phases_{number:02d}",
            "array": {"grid": {"count": list(ARRAYS[number % len(ARRAYS)]), "pitch_mm": 10.16}},
            "body": shape | {"place": {"landmark": landmark, "at_mm": at}},
            "target": {"box": {"at": landmark, "size_mm": [round(width, 1), round(length, 1), 6]}, "pressure_pa": round(pressure, 1)},
            "solve": {"methods": COMPARED, "optimality_bound": True, "resonance_check": "never"}, "evaluation": "none"}


def study(work, count=60):
    """The study is about phases alone, so there is no evaluation mesh. Its scenes run with one thread each."""
    cases = {}
    for number in range(count):
        path = work.runs / f"{number:02d}.yaml"
        path.write_text(json.dumps(scene(number), indent=1))
        cases[number] = (path, [], "--threads", "1")
    scenes = [{row["name"]: {key: float(row[key]) for key in ("cost_skin", "seconds_solve")} for row in table(folder / "metrics.csv") if row["name"] != PAYS}
              for folder in work.solved(cases).values()]
    return {"phase_study_methods": summary(scenes), "phase_study_held": held(scenes)}


def summary(scenes):
    """A row per method: its cost over that of `surface`, how often it is lower, its time."""
    rows = []
    for name in scenes[0]:
        over, times = ([scene[name][key] / scene["surface"][key] for scene in scenes] for key in ("cost_skin", "seconds_solve"))
        rows.append({"method": name, "cost_median": statistics.median(over), "cost_least": min(over), "cost_most": max(over)}
                    | {f"lower_{key}": sum(ratio < 1 - share for ratio in over) / len(over)
                       for key, share in (("at_all", 0), ("permille", 1e-3), ("percent", 1e-2))}
                    | {"seconds": statistics.median(times)})
    return rows


def held(scenes):
    """Shares of the scenes where no other method has a clearly lower cost; the eight restarts take longest."""
    def as_low(name, more, but):
        return sum(scene[name]["cost_skin"] <= (1 + more) * min(own["cost_skin"] for other, own in scene.items() if other not in (name, *but))
                   for scene in scenes) / len(scenes)

    def seconds(name):
        return statistics.median(scene[name]["seconds_solve"] / scene["surface_zero"]["seconds_solve"] for scene in scenes)

    return [{"promise": f"cost at most {1 + more:.3f} times that of every other{' but eight restarts' if but else ''}",
             "key": f"{'single' if but else 'all'}_{more}", "share": as_low("surface", more, but)}
            for but in ((), ("surface_random_8",)) for more in (0, 1e-3, 5e-3, 1e-2, 2e-2, 3e-2)] + [
        {"promise": f"cost of eight restarts at most {1 + more:.3f} times that of every other", "key": f"restarts_{more}",
         "share": as_low("surface_random_8", more, ())} for more in (0, 1e-2)] + [
        {"promise": f"seconds{of} over those of 30 steps from zero, median", "key": key, "share": seconds(name)}
        for name, of, key in (("surface", "", "seconds"), ("surface_random_8", " of eight restarts", "restarts_seconds"))]
