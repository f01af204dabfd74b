"""Rows of the tables that are read from finished runs."""

import json
import pathlib
import re

import h5py
import numpy
from scipy.spatial import cKDTree

from runs import SCENES, results, table

METHODS = ["surface", "paper", "unscattered"]
FINGERS = [name for name in SCENES if name != "grasp"]


def finger_rows(work):
    """Evaluated errors: phases of a finger on the finger and on the whole hand, and phases of the hand."""
    rows = []
    for name in FINGERS:
        alone, there, whole = (results(work / folder) for folder in (
            f"finger/{name}", f"finger/{name}_on_the_hand", f"panels/{name}"))
        rows += [{"scene": name, "method": method, "finger_alone": f"{alone[method]['relative_error']:.9g}",
                  "its_phases_on_the_hand": f"{there[method]['relative_error']:.9g}",
                  "phases_of_the_hand": f"{whole[method]['relative_error']:.9g}"} for method in METHODS]
    return rows


def arm_of(work, name, run, method):
    """Share of the squared pressure that is on the arm."""
    with h5py.File(work / "hand_alone" / name / "run.h5") as alone:
        hand = alone["evaluation/mesh/vertices"][:]
    with h5py.File(work / run / "run.h5") as with_arm:
        evaluation = with_arm["evaluation"]
        corners = evaluation["mesh/vertices"][:][evaluation["mesh/triangles"][:]]
        weight = evaluation["mesh/area"][:] * numpy.abs(evaluation[f"methods/{method}/pressure"][:]) ** 2
    apart = cKDTree(hand).query(corners.mean(axis=1))[0] > 0.006  # m; all edges of the hand are shorter
    return float(weight[apart].sum() / weight.sum())


def arm_rows(work):
    """Phases of a hand alone, on it and on hand and arm, and phases that know the arm; one row per scene and method."""
    rows = []
    for name in SCENES:
        if not (work / "hand_alone" / name).exists():
            continue
        there = f"hand_alone/{name}_with_the_arm"
        alone, unknown, known = (results(work / folder) for folder in (f"hand_alone/{name}", there, f"panels/{name}"))
        rows += [{"scene": name, "method": method, "arm_unknown": f"{arm_of(work, name, there, method):.6g}",
                  "arm_known": f"{arm_of(work, name, f'panels/{name}', method):.6g}",
                  "error_alone": f"{alone[method]['relative_error']:.9g}", "error_unknown": f"{unknown[method]['relative_error']:.9g}",
                  "error_known": f"{known[method]['relative_error']:.9g}",
                  "inside_unknown_pa": f"{unknown[method]['mean_inside_pa']:.6g}",
                  "inside_known_pa": f"{known[method]['mean_inside_pa']:.6g}"} for method in unknown]
    return rows


def convergence_rows(work):
    """Evaluated error and cost by the number of iterations, from runs with METHOD_NN for several NN."""
    rows = []
    for start in ("cold", "warm"):
        folder = work / "convergence" / start
        known, longest = results(folder), {}
        for name, of in known.items():
            longest[name.rsplit("_", 1)[0]] = max(longest.get(name.rsplit("_", 1)[0], []), of["costs"], key=len)
        for name in sorted(known, key=lambda name: (METHODS.index(name.rsplit("_", 1)[0]), name)):
            method, count = name.rsplit("_", 1)
            cost = longest[method]
            rows.append({"start": start, "method": method, "iterations": int(count), "relative_error": f"{known[name]['relative_error']:.9g}",
                         "cost": f"{cost[min(int(count), len(cost) - 1)]:.9g}"})
    return rows


def iteration_times(folder):
    """Times of an iteration and of the preparation, from runs of few and of many steps. One row per case."""
    found = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(errors="replace"), re.M)
    rows = []
    for run in sorted(folder.glob("cases/*/run.h5")):
        known = results(run.parent)
        row = {name: known["once"][name] for name in ("faces", "channels", "target_faces")}
        for method in ("surface", "paper"):
            few, many = known[f"{method}_few"], known[f"{method}_many"]
            steps = float(many["steps"]) - float(few["steps"])
            a_step = (many["seconds_solve"] - few["seconds_solve"]) / steps if steps > 0 else numpy.nan
            row[f"{method}_ms_an_iteration"] = f"{1e3 * a_step:.3g}"
        rows.append(row | {"surface_once_s": f"{known['once']['seconds_solve']:.3g}", "paper_once_s": f"{known['paper_once']['seconds_solve']:.3g}",
                           "threads": known["once"]["threads"], "processor": found[1] if found else "unknown processor"})
    return rows


def change_of(row, inputs):
    """Describes the change of a case of scenes/sweeps/assumptions.yaml."""
    words = {"body.place.rotate_deg": lambda value: f"finger turned by {json.loads(value)[0]:g} degrees about x",
             "medium.temperature_c": lambda value: f"air at {value} C",
             "target.pressure_pa": lambda value: f"wanted pressure {float(value) / 1e3:g} kPa",
             "target.box.size_mm": lambda value: "box {} x {} x {} mm".format(*json.loads(value)),
             "array": lambda value: ("six AUTD3 units, 1,494 transducers" if "autd3" in value else
                                     "directivity " + value.split("directivity: ")[1].strip("} ")),
             "body.hand": lambda value: f"hand {value.split('breadth_mm: ')[1].split(',')[0]} mm broad",
             "body.edge_mm": lambda value: f"edges of {value.split('near_target: ')[1].split(',')[0]} mm near the target"}
    said = []
    for key in (key for key in inputs if row[key] != ""):
        if key == "body.place.at_mm":
            x, _, z = json.loads(row[key])
            said.append(f"{abs(x):g} mm beside the array's axis" if x else f"height {z:g} mm")
        else:
            said.append(words[key](row[key]) if key in words else f"{key} {row[key]}")
    return ", ".join(said)


def assumption_rows(folder):
    """Errors and widths when one assumption changes, with the scene as shipped first."""
    rows = [row for row in table(folder / "sweep.csv") if row["status"] == "ok"]
    columns = list(rows[0])
    inputs = columns[columns.index("status") + 1:columns.index("name")]
    found = {}
    for row in rows:
        found.setdefault(int(row["case"]), (change_of(row, inputs), {}))[1][row["method"]] = row
    first, *others = [found[case] for case in sorted(found)]
    rows = [{"change": change} | {method: f"{float(known[method]['relative_error']):.6g}" for method in (*METHODS, "focus")}
            | {f"width_{method}_mm": f"{float(known[method]['width_mm']):.4g}" for method in METHODS}
            for change, known in [(f"as shipped ({first[0]})", first[1]), *sorted(others, key=lambda item: item[0])]]
    for row in rows:
        row["reduction"] = f"{float(row['unscattered']) - float(row['paper']):.6g}"
    return rows
