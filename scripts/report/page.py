"""Writes the report: figures, tables, Markdown, and one HTML page that contains all of them."""

import base64
import json
import pathlib
import re

import markdown

import arrays
import assumptions
import cameras
import claims
import course
import curves
import delays
import equal
import panels
import sequences
import whole_hand
import widths
import widths_figure
import widths_trials
import widths_words
from runs import SCENES, counted, made, markdown_table, number, percent, provenance, settings, size_of, steps_of, table, write_table

STYLE = """body { max-width: 62em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #111; background: #fff; }
img { max-width: 100%; } table { border-collapse: collapse; font-size: 85%; display: block; overflow-x: auto; }
th, td { border: 1px solid #bbb; padding: .2em .5em; text-align: left; } code { background: #f2f2f2; }"""

OPEN = """The published study does not give the speed of sound, nor the directivity and amplitude of the transducers. It does not give
the place of the array, the height of the finger above it, or the mesh of the hand. The pressure and the length of the boxes are
not given either."""


def taken(work):
    """The values of the scenes that the study leaves open, read from the runs."""
    known = settings(work / "panels/width_8mm", [
        "medium.temperature_c", "array.directivity", "array.source_pa_m", "array.grid.count", "array.grid.pitch_mm", "array.at_mm",
        "body.place.at_mm", "body.edge_mm.near_target", "body.edge_mm.far", "target.pressure_pa", "array.level"])
    columns, lines = json.loads(known["array.grid.count"])
    boxes = [json.loads(settings(work / "panels" / name, ["target.box.size_mm"])["target.box.size_mm"])
             for name in SCENES if name.startswith("width_")]
    return (f"The scenes have air at {known['medium.temperature_c']} C and the directivity `{known['array.directivity']}`. The "
            f"strength of a transducer is {known['array.source_pa_m']} Pa m at full level, and the level is {known['array.level']}. "
            f"The flat array has {columns} x {lines} = {columns * lines:,} transducers with a pitch of {known['array.grid.pitch_mm']} "
            f"mm. Its centre is at {known['array.at_mm']} mm, and the pad is at {known['body.place.at_mm']} mm. The built-in hand has "
            f"edges of {known['body.edge_mm.near_target']} mm near the target and {known['body.edge_mm.far']} mm elsewhere. The boxes "
            "are centred at the pad. They measure " + ", ".join(" x ".join(f"{side:g}" for side in box) for box in boxes)
            + f" mm, and the wanted pressure is {number(float(known['target.pressure_pa']) / 1e3)} kPa. The figure and the table "
            "show the effect of one change at a time for the 8 mm box:")


def is_done(work, *parts):
    """Whether all steps of these parts are done."""
    return all(stamps and all(stamp["done"] for stamp in stamps) for stamps in (steps_of(work, part) for part in parts))


def lines_of(items):
    return "\n".join(f"- {item}" for item in items)


def seconds_of(work):
    """[(part, seconds)] of the steps. The part is the first folder in the name of a step."""
    parts = {}
    for stamp in sorted((work / "steps").glob("*.json")):
        kept = json.loads(stamp.read_text())
        part = stamp.stem.split("-")[0]
        parts[part] = parts.get(part, 0.0) + kept["seconds"]
    return list(parts.items())


class Page:
    """Markdown text with numbered figures and tables."""

    def __init__(self):
        self.parts = []
        self.figures = 0
        self.tables = 0

    def add(self, text):
        self.parts.append(text)

    def figure(self, name, caption, origin):
        self.figures += 1
        self.add(f"![Figure {self.figures}](figures/{name})\n\n*Figure {self.figures}. {caption} Made by {origin.caption()}*")

    def table(self, name, header, rows, origin):
        """A table of text, with a link to the full table."""
        self.tables += 1
        self.add(markdown_table(header, rows))
        self.add(f"*Table {self.tables}. The full table is [tables/{name}](tables/{name}). Made by {origin.caption()}*")

    def text(self):
        return "\n\n".join(self.parts) + "\n"


def html_of(text, folder):
    """One HTML page that contains its pictures."""
    body = markdown.markdown(text, extensions=["tables"])
    body = re.sub(r'src="(figures/[^"]+)"', lambda found: 'src="data:image/png;base64,'
                  + base64.b64encode((folder / found[1]).read_bytes()).decode("ascii") + '"', body)
    title = text.splitlines()[0].lstrip("# ")
    return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n<style>{STYLE}</style>\n'
            f"</head>\n<body>\n{body}\n</body>\n</html>\n")


def add_panels(page, work, report):
    names = list(SCENES)
    origin = made(work, "panels")
    folders = {name: work / "panels" / name for name in names}
    panels.figure(folders, report / "figures/panels.png")
    panels.figure(folders, report / "figures/panels_radiation.png", panels.RADIATION)
    rows = panels.metric_rows(work, names, "panels")
    write_table(report / "tables/metrics.csv", rows, origin)
    page.add("## Patterns on the skin")
    page.figure("panels.png", "Wanted pressure, and absolute pressure on the skin by `paper`, `unscattered`, `surface`, "
                "`radiation` and `focus`. "
                "The view is from the array, with x to the left. The target has a white outline. Each row has one colour scale, from "
                "0 to 1.5 times the largest wanted pressure. The error is the relative L2 error over the whole skin after the best "
                "common scale. The width is the full width at half maximum of |p|^2. Both refer to the evaluation mesh of the scene.",
                origin)
    page.figure("panels_radiation.png", "The same for the radiation pressure P, which presses the skin, with its error and width.", origin)
    page.add(lines_of(panels.sentences(rows, names)))
    page.table("metrics.csv", *panels.short_table(rows), origin)
    page.add("The optimality gap is the relative distance of the cost of `surface` from the optimality bound; for `radiation` it is that of "
             "its own cost. No phases can lower the cost of either by more than that, for the computed matrix. docs/metrics.md defines the metrics.")
    add_equal(page, rows, names, origin)
    if (work / "autd3").exists():
        rows, origin = panels.metric_rows(work, names, "autd3"), made(work, "autd3")
        write_table(report / "tables/metrics_autd3.csv", rows, origin)
        channels = size_of(work / "autd3" / names[0])[1]
        page.add(f"### Patterns with AUTD3 units\n\nThese runs (scenes/autd3) have the {channels:,} transducers of a real array. "
                 "`touchfield send` can send their phases to the device.")
        page.add(lines_of(panels.sentences(rows, names)))
        page.table("metrics_autd3.csv", *panels.short_table(rows), origin)


def add_equal(page, rows, names, origin):
    page.add("### Methods at equal force and equal peak\n\nA common level of all channels scales P by its square. Errors, widths and "
             "shares stay as they are. Methods press with different forces as run, so here all are brought to one force on the target, "
             f"{1e3 * equal.FORCE_N:g} mN, and to one peak of P on the skin, {equal.PEAK_PA} Pa. The level is relative to that of the "
             "runs.")
    page.add(lines_of(equal.sentences(rows, names)))
    page.table("metrics.csv", *equal.summary(rows), origin)


def add_claims(page, work, shares, quick):
    page.add("## Published statements and results")
    page.add(markdown_table(claims.HEADER, claims.rows(
        panels.metric_rows(work, list(SCENES), "panels"), curves.convergence_rows(work), curves.iteration_times(work / "faces"),
        shares, delays.delay_rows(delays.plays(work / "delays", "held")[0], delays.plays(work / "delays", "predicted"),
                                       course.translations(quick)) if is_done(work, "delays") else [])))
    page.add("The sections below explain every row. The model assumes steady sound, a rigid skin and equal transducers. It does not "
             "model perception.")


def add_whole_hand(page, work, report):
    rows, origin = whole_hand.finger_rows(work), made(work, "finger", "panels")
    write_table(report / "tables/finger.csv", rows, origin)
    page.add("## A finger alone and the whole hand\n\nThe published figure shows fingers. In these runs the body is a finger that "
             "ends 50 mm from the target. Phases are found and evaluated on this finger. Then the same phases are evaluated on the "
             "whole hand.")
    page.add(lines_of(whole_hand.finger_sentences(rows)))
    page.table("finger.csv", ["scene", "method", "error on the finger alone", "error of its phases on the hand",
                              "error of phases found for the hand"],
               [[row["scene"], f"`{row['method']}`", *(percent(value) for value in list(row.values())[2:])] for row in rows], origin)
    add_published(page, work, report)


def add_published(page, work, report):
    rows, origin = whole_hand.arm_rows(work), made(work, "hand_alone", "panels")
    write_table(report / "tables/forearm.csv", rows, origin)
    page.add("## As published: a hand that ends at the wrist\n\nThe published study has no arm. In these runs the hand ends 20 mm "
             "behind the wrist (hand alone). Phases are found and evaluated on it. Then the same phases are evaluated on hand and arm. "
             "All other sections have a hand with a forearm of 250 mm, and phases that know it.")
    page.add(lines_of(whole_hand.arm_sentences(rows)))
    page.table("forearm.csv", ["scene", "method", "share of p^2 on the arm, arm unknown", "arm known", "error, hand alone",
                               "error on hand and arm, arm unknown", "arm known"],
               [[row["scene"], f"`{row['method']}`", *(percent(value) for value in list(row.values())[2:7])] for row in rows], origin)
    rows = whole_hand.cost_rows(work)
    write_table(report / "tables/arm_cost.csv", rows, origin)
    page.add("The table shows what the arm costs. The seconds are those of the whole run, with all methods and the optimality bound. "
             "The error is that of `surface`, on the hand alone and on hand and arm.")
    page.table("arm_cost.csv", ["scene", *(f"{name}, {body}" for name in ("faces", "faces of the evaluation", "seconds", "error")
                                          for body in ("hand alone", "hand and arm"))],
               [[row["scene"], *(number(value, 5) for value in list(row.values())[1:5]),
                 *(f"{float(value):.0f}" for value in list(row.values())[5:7]), *map(percent, list(row.values())[7:])] for row in rows],
               origin)
    rows, origin = whole_hand.change_rows(work), made(work, "hand_alone", "moving", "panels")
    write_table(report / "tables/changes.csv", rows, origin)
    page.add("### What each change does\n\nSince release 0.3 faces count by the share of their area in the target, the hand has an arm, "
             "and moving scenes predict. The table has the errors of release 0.3 and after each of these changes, in this order.")
    page.table("changes.csv", ["scene", "method", "release 0.3", "shares of faces", "and the arm", "and prediction"],
               [[row["scene"], f"`{row['method']}`", *(percent(value) if value else "-" for value in list(row.values())[2:])]
                for row in rows], origin)


def add_sequences(page, work, report, quick):
    origin = made(work, "panels/width_8mm")
    rows = sequences.kept_rows(work, quick, origin)
    write_table(report / "tables/sequences.csv", rows, origin)
    page.add("## Fast sequences of patterns\n\nSkin may feel the mean square of the pressure over a fast sequence of patterns. Is a "
             "sequence then closer to the wanted pattern than one pattern? For the 8 mm box, each sequence starts from random phases. "
             "Limited-memory BFGS improves it as a whole (scripts/report/sequences.py).")
    page.add(lines_of(sequences.sentences(rows)))
    shown = ["frames", "starts", "cost_pa2m2", "misfit", "above_bound"]
    page.table("sequences.csv", ["patterns", "starts", "least cost [Pa2 m2]", "misfit", "relative distance from the bound"],
               [[row[key] for key in shown] for row in rows], origin)


def add_curves(page, work, report):
    page.add("## Convergence")
    origin = made(work, "convergence")
    rows = curves.convergence_rows(work)
    curves.convergence_figure(work, report / "figures/convergence.png")
    write_table(report / "tables/convergence.csv", rows, origin)
    page.figure("convergence.png", "Convergence for the 8 mm box. Left: cost above the least cost of the same method. The costs of "
                "different methods are not comparable. Right: evaluated error. Thick lines with filled marks start from zero phases. "
                "Thin lines with hollow marks start from the phases of the previous frame. The hand was then 1 mm away (20 mm/s at the "
                "published 20 frames per second). [tables/convergence.csv](tables/convergence.csv) has the numbers.", origin)
    page.add(lines_of(curves.convergence_sentences(rows)))

    page.add("## Time per iteration")
    by_faces, by_channels = curves.iteration_times(work / "faces"), curves.iteration_times(work / "parameters")
    curves.times_figure(by_faces, by_channels, report / "figures/iteration_time.png")
    ran = provenance(work / "panels" / "width_8mm")
    page.figure("iteration_time.png", f"Time per iteration. Left: for different numbers of faces, with {by_faces[0]['channels']} "
                f"transducers. Right: for different numbers of transducers, with {by_channels[0]['faces']} faces. The program ran with "
                f"{counted(ran['threads'], 'thread')} on {curves.processor()}. Other programs may have used the same computer, so "
                "compare only times in this figure. The published time is that of a graphics card: 10 ms at 10,000 faces and 1,496 "
                "transducers on an RTX 2080 Ti.", made(work, "faces", "parameters"))
    page.add(lines_of(curves.times_sentences(by_faces, by_channels)))
    for name, part, rows in (("iteration_faces", "faces", by_faces), ("iteration_channels", "parameters", by_channels)):
        origin = made(work, part)
        write_table(report / f"tables/{name}.csv", rows, origin)
        page.table(f"{name}.csv", ["faces", "transducers", "target faces", *(
            f"`{method}`, {time}" for time in ("per iteration [ms]", "preparation and first iteration [s]")
            for method in ("surface", "paper"))],
                   [[row[key] for key in ("faces", "channels", "target_faces", "surface_ms_an_iteration", "paper_ms_an_iteration",
                                          "surface_once_s", "paper_once_s")] for row in rows], origin)


def add_study(page, work, report):
    page.add("## Time and error of the schemes")
    origin = made(work, "study")
    curves.study_figure(work, report / "figures/speed_error.png")
    (report / "tables/study.csv").write_text(origin.head() + (work / "study" / "study.csv").read_text(), encoding="utf-8")
    page.figure("speed_error.png", "Time and error of the pressure of one drive vector on the finger of the 8 mm scene "
                "(`touchfield study`). Each mark is a combination of scheme, mesh, solver and precision. The reference for the error is "
                "the best scheme on a mesh that is finer than all others. The table lists the Pareto front: no other combination is "
                "both faster and more accurate.", origin)
    page.table("study.csv", *curves.study_table(work), origin)


def add_assumptions(page, work, report):
    origin = made(work, "assumptions")
    page.add(f"## Effect of open assumptions\n\n{OPEN} {taken(work)}")
    changes = assumptions.read(work / "assumptions")
    assumptions.figure(changes, report / "figures/assumptions.png")
    header, rows = assumptions.summary(changes)
    write_table(report / "tables/assumptions.csv", [dict(zip([name.replace("`", "") for name in header], row)) for row in rows],
                origin)
    page.figure("assumptions.png", "Evaluated error and width of the 8 mm box when one assumption changes. The red line is the wanted "
                "width in the scene as shipped. It extends to the outer edges of the target faces.", origin)
    page.add(lines_of(assumptions.sentences(changes)))
    page.table("assumptions.csv", ["change", *header[1:]], rows, origin)


def add_widths(page, work, report, trials, result):
    origin = made(work, "hands")
    widths.write_tables(result, report / "tables", origin)
    widths_figure.figure(result, trials, report / "figures/widths.png")
    breadths, lengths = zip(*trials.sizes.values())
    page.add("## Can the widths be distinguished?")
    page.add("The published study asked people to distinguish widths of 5, 8 and 11 mm. The shares correct were 0.56 with scattering in "
             "the solver and 0.47 without (Wilcoxon p < 0.05). Chance is 0.33.\n\n"
             f"Here a simulated depth camera sees {len(trials.sizes)} built-in hands. They are {min(breadths):g} to {max(breadths):g} "
             f"mm broad and {min(lengths):g} to {max(lengths):g} mm long. The camera's noise along the normal is "
             f"{trials.noise.min():.2f} to {trials.noise.max():.2f} mm rms, correlated over {trials.correlation_mm:g} mm. The hand is "
             f"also misplaced by {trials.offset_mm_rms:.2f} mm rms along each axis. Phases are found on the skin that the camera saw. "
             "Observers then receive the pressure on the true skin. Each observer learns on the other hands.\n\n"
             + lines_of(["The width reader reads the width at half maximum of abs(p)^2, or of the radiation pressure P, which is what "
                         "presses the skin. It has no noise but the camera's, or Gaussian noise of its own.",
                         "The ideal observer is optimal for patterns that vary as these do. It has internal noise.",
                         "The ideal observer at even level is the same, but all patterns are first scaled to the same mean level. "
                         "Without this, a louder pattern stands out from the noise whatever its shape."]))
    numbers = ", ".join(f"[{name}](tables/{name}.csv)" for name in (
        "widths", "widths_confusion", "widths_wilcoxon", "widths_sigma", "widths_fit", "widths_noise"))
    page.figure("widths.png", "(a) Share correct by observer and method. (b) Share correct of the ideal observers by their internal "
                "noise. (c) Widths meant and answered. (d) Mean profiles. The 95 % intervals cover "
                f"{widths_words.covered(result)}, not people. A fitted noise is fitted again to each resample. "
                f"Numbers: {numbers}.", origin)
    page.add(lines_of(widths_words.sentences(result)))


DELAYS = "## The delay and its effect"
CAMERAS = "## Effect of camera errors"
ARRAYS = "## Patterns in time, tolerances and other arrays"
AGAIN = "## Reproduction"


def add_delays(page, work, report, quick):
    segments = course.translations(quick)
    (held,), predicted = delays.plays(work / "delays", "held"), delays.plays(work / "delays", "predicted")
    origin = made(work, "delays")
    by_displacement = delays.displacement_rows(held, segments)
    tables = {"delays": delays.delay_rows(held, predicted, segments), "delays_by_displacement": by_displacement,
              "delays_answers": delays.answer_rows(by_displacement),
              "delays_noise": delays.noise_rows(delays.plays(work / "delays", "noisy"), segments),
              "delays_tremor": delays.tremor_rows(delays.plays(work / "delays", "tremor"), course.tremors(quick)),
              "delays_loop": delays.loop_rows(delays.plays(work / "delays", "loop"))}
    for name, rows in tables.items():
        write_table(report / f"tables/{name}.csv", rows, origin)
    delays.figure(held, predicted, segments, report / "figures/delays.png")
    page.add(f"{DELAYS}\n\nThe target is the 8 mm box on a finger. The finger moves through its place in the scenes above, 200 mm above "
             "the array. It moves at constant velocity, or it shakes in the direction across the finger. Phases are found on a mesh of "
             "some 570 faces (scenes/moving.yaml), and errors are evaluated on the whole hand. The age of a score is the time since the "
             "sample that its phases are for. Without prediction each frame has 30 iterations and is held for 200 ms, so one play has "
             "all ages. With prediction, sensor noise or tremor, the sensor runs at 30 Hz, and frames come at 20 Hz with 10 iterations "
             "each. Solving takes no time, so the array alone adds a delay. Sensor noise is independent from sample to sample. Points "
             "are percentage points. results/tables/prediction_gain.csv (scripts/prediction_study) has results with cameras, and more "
             "speeds and delays.")
    page.figure("delays.png", "Evaluated error against the age of the sample that the phases are for. Dashed lines are with "
                "`predict: linear`, dotted lines with `predict: kalman`. Numbers: "
                + ", ".join(f"[{name}](tables/{name}.csv)" for name in tables) + ".", origin)
    page.add(lines_of([*delays.answer_sentences(tables["delays_answers"]),
                       *delays.prediction_sentences(tables["delays"], tables["delays_tremor"]),
                       *delays.noise_sentences(tables["delays_noise"]),
                       *delays.loop_sentences(tables["delays_loop"]), delays.reference_sentence(by_displacement)]))
    shown = {"speed_mm_s": "speed [mm/s]", "array_ms": "array delay [ms]", "age_ms_mean": "mean age [ms]",
             "displacement_mm_mean": "mean displacement [mm]", "error_mean": "mean error", "error_p95": "95th percentile"}
    page.table("delays.csv", ["axis", "predict", "method", *shown.values()],
               [[row["axis"], row["predict"], row["method"], *(row[key] for key in list(shown)[:2]),
                 number(row["age_ms_mean"]), number(row["displacement_mm_mean"], 2), percent(row["error_mean"]),
                 percent(row["error_p95"])] for row in tables["delays"]], origin)


def add_cameras(page, work, report, quick):
    origin = made(work, "cameras")
    rows = cameras.rows_of(work / "cameras", quick)
    write_table(report / "tables/cameras.csv", rows, origin)
    cameras.figure(rows, report / "figures/cameras.png")
    noise = report / "tables/widths_noise.csv"
    page.add(f"{CAMERAS}\n\nDepth cameras see the hand of scenes/cameras.yaml. It sways at up to 50 mm/s while its finger flexes. The "
             "built-in hand is fitted to their images (docs/cameras.md). Its shape is learnt from the first second. Phases are found on "
             "some 570 faces of the fitted skin; the rest of the hand has the incident pressure. The phases are evaluated on the whole "
             "true hand. There is no delay here, so any error above that of the exact sensor comes from the sensor. The cameras are "
             "simulated. Their noise is independent from image to image. Their positions and rotations are known exactly unless a row "
             "says otherwise. Changes are relative to the exact sensor, in percentage points.")
    page.figure("cameras.png", "Evaluated error (mean and 95th percentile) against one property of the sensor. Grey lines are for skin "
                "that is known exactly. Squares show how far the skin around the target is off.", origin)
    population = table(cameras.POPULATION)
    page.add(cameras.population_sentence(population))
    page.add(markdown_table(["cameras", "hands", "found", "wrong", "error of the seen skin [mm]",
                             "error of the worst fingertip [mm]"],
                            [[row["cameras"], row["name"], percent(row["found"]), percent(row["wrong"]), row["skin_mm"], row["tip_mm"]]
                             for row in population]))
    page.add(lines_of(cameras.sentences(rows, table(noise) if noise.exists() else [])))
    page.table("cameras.csv", ["sensor", "value", "hand", "lost frames", "skin off by [mm]", "at the target [mm]", "mean error",
                               "95th percentile", "above exact [points]"],
               [[row["sensor"], cameras.shown(row["value"]), cameras.shown(row["hand"]), f"{row['lost']} of {row['frames']}",
                 number(row["skin_mm"], 2), number(row["patch_mm"], 2), percent(row["error_mean"]), percent(row["error_p95"]),
                 cameras.points(row)] for row in rows], origin)


def add_arrays(page, work, report, quick):
    page.add(ARRAYS)
    for text in arrays.texts():
        page.add(text)


# Parts that can be replaced separately, in order.
LAST = {"delays": (DELAYS, add_delays), "cameras": (CAMERAS, add_cameras), "arrays": (ARRAYS, add_arrays)}
KEPT = {"arrays"}  # uses existing tables, without steps


def write_report(work, report, quick):
    """Writes report.md, report.html, figures/ and tables/ into `report` from the runs in `work`."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for part in ("figures", "tables"):
        (report / part).mkdir(parents=True, exist_ok=True)
    ran = provenance(work / "panels" / "width_8mm")
    page = Page()
    page.add("# Pressure patterns on the skin of a hand: the published analysis reproduced and extended")
    if quick:
        page.add("**This is a quick rehearsal with coarse meshes, an eighth of the transducers and few cases. Its numbers mean "
                 "nothing.**")
    page.add("The study is Matsubayashi, Makino, Shinoda, EuroHaptics 2020, doi 10.1007/978-3-030-58147-3_45. These methods are "
             "compared:")
    page.add(lines_of(["`paper` is the published optimisation with the scattering model of this program. Faces are weighted by area.",
                       "`unscattered` is the published comparison. It finds the phases as if the hand did not scatter. Faces are "
                       "weighted by area.",
                       "`paper_original` is `paper` as published, with the published scattering model and equal weights.",
                       "`unscattered_original` is `unscattered` as published, with equal weights.",
                       "`surface` is the method of this program for the pressure's amplitude, `radiation` that for the radiation "
                       "pressure.",
                       "`focus` is phase conjugation."]))
    page.add("Weights by area are needed because the mesh is finer near the target. docs/theory.md and docs/metrics.md have the "
             "definitions.")
    revisions = made(work, *{stamp.stem.split("-")[0] for stamp in (work / "steps").glob("*.json")}).revisions
    page.add(f"The results were computed by touchfield {ran['version']} ({' and '.join(revisions)}) with "
             f"{counted(ran['threads'], 'thread')} on {curves.processor()}."
             + ("" if len(revisions) == 1 else " **They are from several revisions. The captions give the revision of each.**"))
    trials = widths_trials.load(work / "hands") if is_done(work, "hands") else None
    result = widths.analyse(trials) if trials else None
    shares = [{"observer": score.observer, "method": score.method, "share": score.share} for score in result.scores] if result else []
    add_claims(page, work, shares, quick)
    add_panels(page, work, report)
    add_whole_hand(page, work, report)
    add_sequences(page, work, report, quick)
    add_curves(page, work, report)
    later = {"study": ("Time and error of the schemes", lambda: add_study(page, work, report)),
             "assumptions": ("Effect of open assumptions", lambda: add_assumptions(page, work, report)),
             "hands": ("Can the widths be distinguished?", lambda: add_widths(page, work, report, trials, result))}
    later |= {part: (title.lstrip("# "), lambda add=add: add(page, work, report, quick)) for part, (title, add) in LAST.items()}
    there = {part for part in later if part in KEPT or is_done(work, part)}
    for part, (_, add) in later.items():
        if part in there:
            add()
    missing = [words for part, (words, _) in later.items() if part not in there]
    if missing:
        page.add(f"## Missing sections\n\n{'This section has' if len(missing) == 1 else 'These sections have'} not been computed with "
                 "this revision. Call `scripts/reproduce` to continue.")
        page.add(lines_of(missing))
    page.add(f"{AGAIN}\n\n`scripts/reproduce` computes all results and writes this report. The seeds are in the scenes and sweeps. "
             "With `--quick` it computes a small version. With `--report-only` it writes the report from existing results.")
    parts = seconds_of(work)
    page.add(markdown_table(["part", "seconds"], [[name, f"{seconds:.0f}"] for name, seconds in parts]
                            + [["all", f"{sum(seconds for _, seconds in parts):.0f}"]]))
    write_page(page.text(), report)


def write_page(text, report):
    (report / "report.md").write_text(text, encoding="utf-8")
    (report / "report.html").write_text(html_of(text, report), encoding="utf-8")


def refresh(part, work, report, quick):
    """Replaces or inserts one of the parts in LAST, in the existing report or a new one."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for folder in ("figures", "tables"):
        (report / folder).mkdir(parents=True, exist_ok=True)
    kept = (report / "report.md").read_text(encoding="utf-8") if (report / "report.md").exists() else f"# {part.capitalize()} alone\n"
    title, add = LAST[part]
    own = kept.find(f"{title}\n")
    later = [kept.find(f"{name}\n") for name in [*(other for other, _ in LAST.values()), AGAIN]]
    end = min((at for at in later if at > max(own, 0) and at >= 0), default=len(kept))
    if own < 0:  # insert it before the parts that follow it
        follows = list(LAST)[list(LAST).index(part) + 1:]
        own = end = min((at for at in (kept.find(f"{name}\n") for name in [*(LAST[other][0] for other in follows), AGAIN]) if at >= 0),
                        default=len(kept))
    before, after = kept[:own], kept[end:]
    page = Page()
    page.figures, page.tables = (max((int(found) for found in re.findall(rf"^\*{kind} (\d+)", before, re.M)), default=0)
                                 for kind in ("Figure", "Table"))
    add(page, work, report, quick)
    write_page(before.rstrip("\n") + "\n\n" + page.text() + (f"\n{after}" if after else ""), report)
