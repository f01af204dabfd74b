"""Effects of skin that the model leaves out: a finger alone and the whole hand, a hand alone and with its arm."""

import json
import pathlib

import h5py
import numpy
from scipy.spatial import cKDTree

from curves import METHODS
from runs import SCENES, attributes, percent, table

RELEASE = pathlib.Path(__file__).resolve().parents[2] / "results/tables/release_0_3.csv"
PAIRS = {"`paper` and `unscattered`": ("paper", "unscattered"),
         "`paper_original` and `unscattered_original`": ("paper_original", "unscattered_original")}
FINGERS = [name for name in SCENES if name != "grasp"]


def finger_rows(work):
    """Evaluated errors: phases of a finger on the finger and on the whole hand, and phases of the hand."""
    rows = []
    for name in FINGERS:
        alone, there, whole = (attributes(work / folder) for folder in (
            f"finger/{name}", f"finger/{name}_on_the_hand", f"panels/{name}"))
        rows += [{"scene": name, "method": method, "finger_alone": f"{alone[method]['relative_error']:.9g}",
                  "its_phases_on_the_hand": f"{there[method]['relative_error']:.9g}",
                  "phases_of_the_hand": f"{whole[method]['relative_error']:.9g}"} for method in METHODS]
    return rows


def order(rows, scene, column):
    own = sorted((row for row in rows if row["scene"] == scene), key=lambda row: float(row[column]))
    return " < ".join(f"`{row['method']}`" for row in own)


def finger_sentences(rows):
    said = []
    for name in FINGERS:
        orders = {column: order(rows, name, column) for column in ("finger_alone", "its_phases_on_the_hand", "phases_of_the_hand")}
        same = "the same" if orders["finger_alone"] == orders["its_phases_on_the_hand"] else orders["its_phases_on_the_hand"]
        said.append(f"{SCENES[name]}: on the finger alone, the order of the errors is {orders['finger_alone']}. With the same phases on "
                    f"the hand, it is {same}. With phases found for the hand, it is {orders['phases_of_the_hand']}.")
    off = [float(row["its_phases_on_the_hand"]) for row in rows]
    said.append(f"On the hand, the error of phases found for a finger is {span(off, '{:.0%}')}.")
    return said


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
        alone, unknown, known = (attributes(work / folder) for folder in (f"hand_alone/{name}", there, f"panels/{name}"))
        rows += [{"scene": name, "method": method, "arm_unknown": f"{arm_of(work, name, there, method):.6g}",
                  "arm_known": f"{arm_of(work, name, f'panels/{name}', method):.6g}",
                  "error_alone": f"{alone[method]['relative_error']:.9g}", "error_unknown": f"{unknown[method]['relative_error']:.9g}",
                  "error_known": f"{known[method]['relative_error']:.9g}",
                  "inside_unknown_pa": f"{unknown[method]['mean_inside_pa']:.6g}",
                  "inside_known_pa": f"{known[method]['mean_inside_pa']:.6g}"} for method in unknown]
    return rows


def cost_rows(work):
    """What the arm costs: faces, seconds of a run, points of `surface`."""
    def of(folder):
        with h5py.File(work / folder / "run.h5") as run:
            faces = len(run["mesh/area"]), len(run["evaluation/mesh/area"])
            error = run["methods/surface"].attrs["relative_error"]
        return *faces, json.loads((work / "steps" / f"{folder.replace('/', '-')}.json").read_text())["seconds"], error

    rows = []
    for name in SCENES:
        if (work / "hand_alone" / name).exists():
            columns = zip(("faces", "evaluation_faces", "seconds", "error"), of(f"hand_alone/{name}"), of(f"panels/{name}"))
            rows.append({"scene": name} | {key: f"{value:.6g}" for column, alone, whole in columns
                                           for key, value in ((f"{column}_alone", alone), (column, whole))})
    return rows


def change_rows(work):
    """Errors of release 0.3 and after each change since: shares of faces, arm, prediction. Empty: it has no effect."""
    before = {(row["scene"], row["method"]): row["error"] for row in table(RELEASE)}
    rows = [{"scene": row["scene"], "method": row["method"], "release_0_3": before[row["scene"], row["method"]],
             "shares": row["error_alone"], "arm": row["error_known"], "prediction": ""} for row in arm_rows(work)]

    def played(name):
        scores = [float(row["relative_error"]) for row in table(work / f"moving/{name}/motion.csv")
                  if row["method"] == "surface" and int(row["frame"]) >= 0]
        return f"{numpy.mean(scores):.9g}"

    return [*rows, {"scene": "moving", "method": "surface", "release_0_3": before["moving", "surface"]}
            | {column: played(name) for column, name in (("shares", "alone"), ("arm", "arm"), ("prediction", "shipped"))}]


def span(values, form="{:.1%}"):
    """The range of the values, or one number if its ends look the same."""
    said = [form.format(value).replace("%", " %") for value in (min(values), max(values))]
    return " to ".join(dict.fromkeys(said))


def arm_sentences(rows):
    surface = [row for row in rows if row["method"] == "surface"]
    error = {(row["scene"], row["method"], column): float(row[column]) for row in rows
             for column in ("error_alone", "error_unknown", "error_known")}
    scenes = [row["scene"] for row in surface]
    said = []
    for pair, (one, other) in PAIRS.items():
        counts = [sum(error[scene, one, column] < error[scene, other, column] for scene in scenes)
                  for column in ("error_alone", "error_unknown", "error_known")]
        said.append(f"Of {pair}, the first has the smaller error on {counts[0]} of {len(scenes)} scenes on the hand alone. With the "
                    f"same phases on hand and arm it is {counts[1]}, and with phases that know the arm {counts[2]}.")
    for column, where in (("error_alone", "On the hand alone"), ("error_known", "On hand and arm, with the arm known")):
        errors = [[error[scene, method, column] for method in METHODS] for scene in scenes]
        said.append(f"{where}, the errors are in the order `surface` <= `paper` <= `unscattered` on "
                    f"{sum(one == sorted(one) for one in errors)} of {len(scenes)} scenes.")
    unknown, known = ([float(row[column]) for row in surface] for column in ("arm_unknown", "arm_known"))
    changed = [100 * (float(row["error_known"]) - float(row["error_unknown"])) for row in surface]
    inside = [float(row["inside_known_pa"]) / float(row["inside_unknown_pa"]) - 1 for row in surface]
    return [*said,
            f"With `surface`, an unknown arm receives {span(unknown)} of the squared pressure on all skin. A known arm receives "
            f"{span(known)}.",
            f"Phases that know the arm change the error over hand and arm by {span(changed, '{:+.1f}')} percentage points. They "
            f"change the mean pressure on the target by {span(inside, '{:+.1%}')}."]
