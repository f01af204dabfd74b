"""Effects of skin that the model leaves out: a finger alone and the whole hand, a hand with and without the arm."""

import h5py
import numpy
from scipy.spatial import cKDTree

from curves import METHODS
from runs import SCENES, attributes, percent

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


def arm_of(work, name, run):
    """Share of the squared pressure that is on the arm, for `surface` in a run with a forearm."""
    with h5py.File(work / "panels" / name / "run.h5") as known:
        hand = known["evaluation/mesh/vertices"][:]
    with h5py.File(work / run / "run.h5") as with_arm:
        evaluation = with_arm["evaluation"]
        corners = evaluation["mesh/vertices"][:][evaluation["mesh/triangles"][:]]
        weight = evaluation["mesh/area"][:] * numpy.abs(evaluation["methods/surface/pressure"][:]) ** 2
    apart = cKDTree(hand).query(corners.mean(axis=1))[0] > 0.006  # m; all edges of both meshes are shorter
    return float(weight[apart].sum() / weight.sum())


def arm_rows(work):
    rows = []
    for name in SCENES:
        if not (work / "forearm" / name).exists():
            continue
        methods = attributes(work / f"forearm/{name}")
        unknown, known = attributes(work / f"forearm/{name}_of_the_hand")["surface"], methods["surface"]
        rows.append({"scene": name, "arm_unknown": f"{arm_of(work, name, f'forearm/{name}_of_the_hand'):.6g}",
                     "arm_known": f"{arm_of(work, name, f'forearm/{name}'):.6g}",
                     "error_unknown": f"{unknown['relative_error']:.9g}", "error_known": f"{known['relative_error']:.9g}",
                     "paper_known": f"{methods['paper']['relative_error']:.9g}",
                     "unscattered_known": f"{methods['unscattered']['relative_error']:.9g}",
                     "inside_unknown_pa": f"{unknown['mean_inside_pa']:.6g}", "inside_known_pa": f"{known['mean_inside_pa']:.6g}"})
    return rows


def span(values, form="{:.1%}"):
    """The range of the values, or one number if its ends look the same."""
    said = [form.format(value).replace("%", " %") for value in (min(values), max(values))]
    return " to ".join(dict.fromkeys(said))


def arm_sentences(rows):
    unknown, known = ([float(row[column]) for row in rows] for column in ("arm_unknown", "arm_known"))
    changed = [100 * (float(row["error_known"]) - float(row["error_unknown"])) for row in rows]
    inside = [float(row["inside_known_pa"]) / float(row["inside_unknown_pa"]) - 1 for row in rows]
    errors = [[float(row[column]) for column in ("error_known", "paper_known", "unscattered_known")] for row in rows]
    ordered = sum(one == sorted(one) for one in errors)
    return [f"With the arm known, the errors are in the order `surface` <= `paper` <= `unscattered` on {ordered} of {len(rows)} "
            f"{'scene' if len(rows) == 1 else 'scenes'}.",
            f"An unknown arm receives {span(unknown)} of the squared pressure on all skin. A known arm receives {span(known)}.",
            f"Phases that know the arm change the error over hand and arm by {span(changed, '{:+.1f}')} percentage points. They "
            f"change the mean pressure on the target by {span(inside, '{:+.1%}')}."]
