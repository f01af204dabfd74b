"""Effect of unsolved skin: a finger alone against the whole hand, and of the arm behind the hand."""

import h5py
import numpy
from scipy.spatial import cKDTree

from curves import METHODS
from runs import SCENES, attributes, percent

FINGERS = [name for name in SCENES if name != "grasp"]


def finger_rows(work):
    """Judged error of phases of a finger on that finger and on its hand, and of phases of the hand there."""
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
        same = "the same order" if orders["finger_alone"] == orders["its_phases_on_the_hand"] else orders["its_phases_on_the_hand"]
        said.append(f"{SCENES[name]}: by the finger alone {orders['finger_alone']}; these phases on the hand: {same}; phases of the "
                    f"hand: {orders['phases_of_the_hand']}.")
    off = [float(row["its_phases_on_the_hand"]) for row in rows]
    said.append(f"On the hand, phases of a finger miss by {percent(min(off), 0)} to {percent(max(off), 0)}.")
    return said


def arm_of(work, name, run):
    """Sum of p^2 over the arm as a share of that over all skin, of `surface` in a run with a forearm."""
    with h5py.File(work / "panels" / name / "run.h5") as known:
        hand = known["judge/mesh/vertices"][:]
    with h5py.File(work / run / "run.h5") as with_arm:
        judge = with_arm["judge"]
        corners = judge["mesh/vertices"][:][judge["mesh/triangles"][:]]
        weight = judge["mesh/area"][:] * numpy.abs(judge["methods/surface/pressure"][:]) ** 2
    apart = cKDTree(hand).query(corners.mean(axis=1))[0] > 0.006  # m; the edges of either mesh are shorter
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
    """From the least to the largest; one number where they are the same."""
    said = [form.format(value).replace("%", " %") for value in (min(values), max(values))]
    return " to ".join(dict.fromkeys(said))


def arm_sentences(rows):
    unknown, known = ([float(row[column]) for row in rows] for column in ("arm_unknown", "arm_known"))
    changed = [100 * (float(row["error_known"]) - float(row["error_unknown"])) for row in rows]
    inside = [float(row["inside_known_pa"]) / float(row["inside_unknown_pa"]) - 1 for row in rows]
    errors = [[float(row[column]) for column in ("error_known", "paper_known", "unscattered_known")] for row in rows]
    return [f"With the arm known, `surface` <= `paper` <= `unscattered` on {sum(one == sorted(one) for one in errors)} of {len(rows)} scenes.",
            f"A forearm of 250 mm that the phases do not know receives {span(unknown)} of the squared pressure on all skin; where they "
            f"know it, {span(known)}.",
            f"Knowing it changes the error over hand and arm by {span(changed, '{:+.1f}')} points, and the mean pressure on the target by "
            f"{span(inside, '{:+.1%}')}."]
