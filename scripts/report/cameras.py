"""The cost of seeing the hand with cameras: plays of one motion with several sensors."""

import pathlib

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

import sights  # noqa: E402
from runs import number, percent, table  # noqa: E402

METHOD = "surface"
POPULATION = pathlib.Path(__file__).parents[2] / "results/tables/hand_population.csv"  # kept: scripts/hand_population
GROUPS = {"noise": "noise of the skin itself [mm rms]", "cameras": "D415 cameras", "disparity noise": "disparity noise [pixels rms]",
          "distance": "distance [0.35 to 0.39 m]", "place error": "error of the cameras' places [mm]",
          "turn error": "error of their turn [deg]", "model": "model", "hand": "hand"}
STANDARD = {"disparity noise": "0.08", "distance": "1", "place error": "0", "turn error": "0", "model": "d415",
            "hand": sights.TEMPLATES}  # what the case of three cameras has


def folders(work):
    """{name of the scene: folder} of a sweep's cases."""
    found = {}
    for case in sorted(pathlib.Path(work).glob("cases/[0-9]*")):
        with h5py.File(case / "motion.h5") as motion:
            found[motion.attrs["name"]] = case
    return found


def row_of(case, folder):
    """One case: of its frames after the first ones, and of the scores that these sound in."""
    frames = table(folder / "frames.csv")[sights.SETTLED:]
    scores = [row for row in table(folder / "motion.csv") if int(row["frame"]) >= sights.SETTLED]
    error = numpy.array([float(row["relative_error"]) for row in scores if row["relative_error"] not in ("", "nan")])
    lost = sum(row["lost"] == "1" for row in frames)

    def mean(key):
        values = numpy.array([float(row[key]) for row in frames if row[key] not in ("", "nan")])
        return f"{numpy.sqrt((values ** 2).mean()):.4g}" if len(values) else "nan"

    return {"sensor": case.group, "value": case.value, "hand": case.hand,
            "frames": str(len(frames)), "lost": str(lost), "skin_mm": mean("skin_off_mm"), "patch_mm": mean("patch_off_mm"),
            "error_mean": f"{error.mean():.6g}" if len(error) else "nan",
            "error_p95": f"{numpy.percentile(error, 95):.6g}" if len(error) else "nan"}


def rows_of(work, quick):
    """A row a case; `above` is the mean error above that of the exact sensor of the same hand's same motion."""
    found = folders(work)
    cases = sights.cases(quick)
    rows = [row_of(case, found[case.name()]) for case in cases]
    exact = {case.same(): float(row["error_mean"]) for case, row in zip(cases, rows) if case.group == "exact"}
    return [row | {"above": f"{float(row['error_mean']) - exact[case.same()]:.6g}"} for case, row in zip(cases, rows)]


def group_of(rows, group):
    """Rows of a group and the standard case, where there is one, in the order of their values."""
    own = [row for row in rows if row["sensor"] == group]
    if group in STANDARD:
        own += [row | {"value": STANDARD[group]} for row in rows if (row["sensor"], row["value"]) == ("cameras", "3")]
    return sorted(own, key=lambda row: float(row["value"])) if group not in ("model", "hand") else own


def points(row):
    above = float(row["above"])
    return "-" if above != above else f"{100 * above:+.1f}"


def seen(row):
    """What a case came to, in words."""
    lost = f", lost in {row['lost']} of {row['frames']} frames" if row["lost"] != "0" else ""
    return (f"{row['value']}: always lost" if row["lost"] == row["frames"]
            else f"{row['value']}: {points(row)} points, {number(row['patch_mm'], 2)} mm about the target{lost}")


def sentences(rows, thirds):
    """thirds   of widths_noise.csv, or none"""
    exact = next(row for row in rows if row["sensor"] == "exact" and row["hand"] == sights.TEMPLATES)
    three = next(row for row in rows if (row["sensor"], row["value"]) == ("cameras", "3"))
    said = [f"With the skin known exactly the judged error of `{METHOD}` is {percent(exact['error_mean'])} on average; with three D415 "
            f"cameras and the fitted hand {points(three)} points ({percent(three['error_mean'])}), the skin off by "
            f"{number(three['skin_mm'], 2)} mm rms and by {number(three['patch_mm'], 2)} mm about the target."]
    for group, words in GROUPS.items():
        own = group_of(rows, group)
        if len(own) > 1 or group == "noise":
            said.append(f"By {words}: " + "; ".join(map(seen, own)) + ".")
    worst = max((row for row in rows if row["sensor"] in GROUPS and row["error_mean"] != "nan"), key=lambda row: float(row["above"]))
    said.append(f"The most that any of these sensors costs is {points(worst)} points ({GROUPS[worst['sensor']]}: {worst['value']}).")
    if thirds:
        said.append(explanation(three, thirds))
    return said


def explanation(three, thirds):
    """Can the cameras be why people were right in 0.56 of the trials only?"""
    own = {row["third"]: row for row in thirds if (row["observer"], row["method"]) == ("width reader", "paper")}
    low, high = own["lowest"], own["highest"]
    off = float(three["patch_mm"])
    within = "less than" if off < float(low["noise_high_mm"]) else "within" if off < float(high["noise_high_mm"]) else "more than"
    lost = float(low["share"]) - float(high["share"])
    answer = "cannot" if lost < 0.2 and within != "more than" else "may"
    return (f"**Can camera errors explain that people were right in 0.56?** A reader of the width is right in {float(low['share']):.2f} of "
            f"the trials with `paper` where the skin is known within {number(low['noise_high_mm'], 2)} mm rms, and in "
            f"{float(high['share']):.2f} between {number(high['noise_low_mm'], 2)} and {number(high['noise_high_mm'], 2)} mm; three cameras "
            f"and the fit are off by {number(off, 2)} mm about the target, {within} that. By this model they {answer}.")


def population_sentence(rows):
    """Of the kept table of hands that the built-in hand cannot make (scripts/hand_population)."""
    total = {row["cameras"]: row for row in rows if (row["group"], row["name"]) == ("kind", "all")}
    return (f"Hands of other people: {total['1']['hands']} hands of the body model anny, seen by its own renderer with noise, holes, sleeves, "
            f"objects and walls. One camera's single image is enough to find {percent(total['1']['found'])} of them, three cameras find "
            f"{percent(total['3']['found'])} of the frames; {percent(total['3']['wrong'])} are more than 6 mm rms off. Median over the frames: the seen "
            f"skin is {total['1']['skin_mm']} and {total['3']['skin_mm']} mm rms off, the farthest fingertip {total['1']['tip_mm']} and "
            f"{total['3']['tip_mm']} mm (results/tables/hand_population.csv).")


def figure(rows, path):
    groups = [group for group in GROUPS if group not in ("model", "hand") and len(group_of(rows, group)) > 1]
    if not groups:
        groups = ["noise"]
    drawing, panels = pyplot.subplots(1, len(groups), figsize=(2.6 * len(groups) + 0.6, 3.2), layout="constrained", sharey=True,
                                      squeeze=False)
    for panel, group in zip(panels[0], groups):
        own = group_of(rows, group)
        values = [float(row["value"]) for row in own]
        panel.plot(values, [100 * float(row["error_mean"]) for row in own], color="#0072B2", marker="o", label="judged error [%]")
        panel.plot(values, [100 * float(row["error_p95"]) for row in own], color="#0072B2", linestyle=":", label="95 %")
        panel.plot(values, [100 * (float(row["error_mean"]) - float(row["above"])) for row in own], color="0.5", linewidth=0.8)
        panel.set_xlabel(GROUPS[group], fontsize=9)
        panel.grid(color="0.9")
        twin = panel.twinx()
        twin.plot(values, [float(row["patch_mm"]) for row in own], color="#D55E00", marker="s", linestyle="--")
        twin.set_ylim(0, max(0.1, 1.15 * max(float(row["patch_mm"]) for row in rows if row["patch_mm"] != "nan")))
        if group == groups[-1]:
            twin.set_ylabel("skin at the target off [mm]", color="#D55E00")
        else:
            twin.set_yticklabels([])
    panels[0, 0].set_ylabel("judged error [%]", color="#0072B2")
    panels[0, 0].legend(fontsize=8)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)
