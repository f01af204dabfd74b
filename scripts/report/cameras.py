"""Effect of camera errors, from plays of one motion with several sensors."""

import pathlib

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

import sights  # noqa: E402
from runs import listed, number, percent, table  # noqa: E402

METHOD = "surface"
POPULATION = pathlib.Path(__file__).parents[2] / "results/tables/hand_population.csv"  # written by scripts/hand_population
GROUPS = {"noise": "skin noise without cameras [mm rms]", "cameras": "number of D415 cameras",
          "disparity noise": "disparity noise [pixels rms]", "distance": "distance [times 0.35 to 0.39 m]",
          "place error": "error of the camera positions [mm]", "turn error": "error of the camera rotations [deg]",
          "model": "camera model", "hand": "hand"}
HANDS = {sights.TEMPLATES: "default size"}  # names that are not shown as they are in the table
STANDARD = {"disparity noise": "0.08", "distance": "1", "place error": "0", "turn error": "0", "model": "d415",
            "hand": sights.TEMPLATES}  # values in the case with three cameras


def folders(work):
    """{name of the scene: folder} of the cases of a sweep."""
    found = {}
    for case in sorted(pathlib.Path(work).glob("cases/[0-9]*")):
        with h5py.File(case / "motion.h5") as motion:
            found[motion.attrs["name"]] = case
    return found


def row_of(case, folder):
    """The row of a case, from the frames after the first ones and the scores while they sound."""
    frames = table(folder / "frames.csv")[sights.SETTLED:]
    scores = [row for row in table(folder / "motion.csv") if int(row["frame"]) >= sights.SETTLED]
    error = numpy.array([float(row["relative_error"]) for row in scores if row["relative_error"] not in ("", "nan")])
    lost = sum(row["lost"] == "1" for row in frames)

    def rms(key):
        values = numpy.array([float(row[key]) for row in frames if row[key] not in ("", "nan")])
        return f"{numpy.sqrt((values ** 2).mean()):.4g}" if len(values) else "nan"

    return {"sensor": case.group, "value": case.value, "hand": case.hand,
            "frames": str(len(frames)), "lost": str(lost), "skin_mm": rms("skin_off_mm"), "patch_mm": rms("patch_off_mm"),
            "error_mean": f"{error.mean():.6g}" if len(error) else "nan",
            "error_p95": f"{numpy.percentile(error, 95):.6g}" if len(error) else "nan"}


def rows_of(work, quick):
    """One row per case. `above` is the mean error minus that of the exact sensor for the same hand and motion."""
    found = folders(work)
    cases = sights.cases(quick)
    rows = [row_of(case, found[case.name()]) for case in cases]
    exact = {case.same(): float(row["error_mean"]) for case, row in zip(cases, rows) if case.group == "exact"}
    return [row | {"above": f"{float(row['error_mean']) - exact[case.same()]:.6g}"} for case, row in zip(cases, rows)]


def group_of(rows, group):
    """Rows of a group in the order of their values, with the standard case if the group has one."""
    own = [row for row in rows if row["sensor"] == group]
    if group in STANDARD:
        own += [row | {"value": STANDARD[group]} for row in rows if (row["sensor"], row["value"]) == ("cameras", "3")]
    return sorted(own, key=lambda row: float(row["value"])) if group not in ("model", "hand") else own


def points(row):
    above = float(row["above"])
    return "-" if above != above else f"{100 * above:+.1f}"


def shown(value):
    return HANDS.get(value, value)


def group_sentence(words, own):
    """Changes of the error and errors of the skin for the rows of a group."""
    seen = [row for row in own if row["lost"] != row["frames"]]
    said = []
    if seen:
        changes = listed([f"{points(row)} points ({shown(row['value'])})" for row in seen])
        off = listed([f"{number(row['patch_mm'], 2)} mm" for row in seen])
        said = [f"The mean error changes by {changes}.", f"The skin around the target is off by {off}."]
    said += [f"The hand is lost in {row['lost']} of {row['frames']} frames ({shown(row['value'])})."
             for row in seen if row["lost"] != "0"]
    said += [f"The hand is always lost ({shown(row['value'])})." for row in own if row not in seen]
    return f"**{words[0].upper()}{words[1:]}.** " + " ".join(said)


def sentences(rows, thirds):
    """`thirds` are the rows of widths_noise.csv, or empty."""
    exact = next(row for row in rows if row["sensor"] == "exact" and row["hand"] == sights.TEMPLATES)
    three = next(row for row in rows if (row["sensor"], row["value"]) == ("cameras", "3"))
    said = [f"With the skin known exactly, the mean evaluated error of `{METHOD}` is {percent(exact['error_mean'])}. Three D415 cameras "
            f"and the fitted hand change it by {points(three)} points to {percent(three['error_mean'])}. The fitted skin is off by "
            f"{number(three['skin_mm'], 2)} mm rms, and by {number(three['patch_mm'], 2)} mm rms around the target."]
    for group, words in GROUPS.items():
        own = group_of(rows, group)
        if len(own) > 1 or group == "noise":
            said.append(group_sentence(words, own))
    worst = max((row for row in rows if row["sensor"] in GROUPS and row["error_mean"] != "nan"), key=lambda row: float(row["above"]))
    said.append(f"The largest change among these sensors is {points(worst)} points "
                f"({GROUPS[worst['sensor']]}: {shown(worst['value'])}).")
    if thirds:
        said.append(explanation(three, thirds))
    return said


def explanation(three, thirds):
    """Whether camera errors can explain that people were right in only 0.56 of the trials."""
    own = {row["third"]: row for row in thirds if (row["observer"], row["method"]) == ("width reader", "paper")}
    low, high = own["lowest"], own["highest"]
    off = float(three["patch_mm"])
    largest = number(high["noise_high_mm"], 2)
    compared = (f"below {number(low['noise_high_mm'], 2)} mm" if off < float(low["noise_high_mm"])
                else f"below {largest} mm" if off < float(high["noise_high_mm"]) else f"not below {largest} mm")
    lost = float(low["share"]) - float(high["share"])
    answer = "cannot" if lost < 0.2 and off < float(high["noise_high_mm"]) else "may"
    return ("**Can camera errors explain that people were right in only 0.56 of the trials?** With `paper` and skin noise of at most "
            f"{number(low['noise_high_mm'], 2)} mm rms, an observer who reads the width is right in {float(low['share']):.2f} of the "
            f"trials. With {number(high['noise_low_mm'], 2)} to {largest} mm rms the observer is right in {float(high['share']):.2f}. "
            f"With three cameras and the fitted hand, the skin around the target is off by {number(off, 2)} mm, which is {compared}. "
            f"By this model camera errors {answer} explain it.")


def population_sentence(rows):
    """From the table of scripts/hand_population, with hands that the built-in hand cannot reproduce."""
    total = {row["cameras"]: row for row in rows if (row["group"], row["name"]) == ("kind", "all")}
    one, three = total["1"], total["3"]
    return (f"The fit was also tested on {one['hands']} hands of the body model anny (results/tables/hand_population.csv). A separate "
            "renderer makes the images, with noise, holes, sleeves, objects and walls. In a single image of one camera, "
            f"{percent(one['found'])} of the hands are found. With three cameras the hand is found in {percent(three['found'])} of the "
            f"frames. In {percent(three['wrong'])} of the frames the fitted skin is more than 6 mm rms off. Over the found hands, the "
            f"median error of the seen skin is {one['skin_mm']} mm rms with one camera and {three['skin_mm']} mm rms with three. The "
            f"median error of the worst fingertip is {one['tip_mm']} mm with one camera and {three['tip_mm']} mm with three.")


def figure(rows, path):
    groups = [group for group in GROUPS if group not in ("model", "hand") and len(group_of(rows, group)) > 1]
    if not groups:
        groups = ["noise"]
    drawing, panels = pyplot.subplots(1, len(groups), figsize=(2.6 * len(groups) + 0.6, 3.2), layout="constrained", sharey=True,
                                      squeeze=False)
    for panel, group in zip(panels[0], groups):
        own = group_of(rows, group)
        values = [float(row["value"]) for row in own]
        panel.plot(values, [100 * float(row["error_mean"]) for row in own], color="#0072B2", marker="o", label="mean")
        panel.plot(values, [100 * float(row["error_p95"]) for row in own], color="#0072B2", linestyle=":", label="95th percentile")
        panel.plot(values, [100 * (float(row["error_mean"]) - float(row["above"])) for row in own], color="0.5", linewidth=0.8)
        panel.set_xlabel(GROUPS[group], fontsize=9)
        panel.grid(color="0.9")
        twin = panel.twinx()
        twin.plot(values, [float(row["patch_mm"]) for row in own], color="#D55E00", marker="s", linestyle="--")
        twin.set_ylim(0, max(0.1, 1.15 * max(float(row["patch_mm"]) for row in rows if row["patch_mm"] != "nan")))
        if group == groups[-1]:
            twin.set_ylabel("skin error at the target [mm]", color="#D55E00")
        else:
            twin.set_yticklabels([])
    panels[0, 0].set_ylabel("evaluated error [%]", color="#0072B2")
    panels[0, 0].legend(fontsize=8)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)
