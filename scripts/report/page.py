"""The report: figures, tables, Markdown, and one HTML page with all of them."""

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
import panels
import sequences
import whole_hand
import widths
import widths_figure
import widths_trials
import widths_words
from runs import SCENES, made, markdown_table, number, percent, provenance, settings, size_of, steps_of, table, write_table

STYLE = """body { max-width: 62em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #111; background: #fff; }
img { max-width: 100%; } table { border-collapse: collapse; font-size: 85%; display: block; overflow-x: auto; }
th, td { border: 1px solid #bbb; padding: .2em .5em; text-align: left; } code { background: #f2f2f2; }"""

OPEN = """The published study does not say how fast sound was taken to be, how the transducers' directivity and amplitude were
modelled, where the array was, how high the finger was above it, which mesh the hand had, how strong and how long the boxes
were."""


def taken(work):
    """What the scenes take for what the study leaves open, from the scene that ran."""
    known = settings(work / "panels/width_8mm", [
        "medium.temperature_c", "array.directivity", "array.source_pa_m", "array.grid.count", "array.grid.pitch_mm", "array.at_mm",
        "body.place.at_mm", "body.edge_mm.near_target", "body.edge_mm.far", "target.pressure_pa", "array.level"])
    columns, lines = json.loads(known["array.grid.count"])
    boxes = [json.loads(settings(work / "panels" / name, ["target.box.size_mm"])["target.box.size_mm"])
             for name in SCENES if name.startswith("width_")]
    return (f"Taken here: air at {known['medium.temperature_c']} C, directivity `{known['array.directivity']}`, "
            f"{known['array.source_pa_m']} Pa m per transducer at full level, level {known['array.level']}, a flat array of {columns} x {lines} ({columns * lines:,} transducers, "
            f"{known['array.grid.pitch_mm']} mm apart), its middle at {known['array.at_mm']} mm, the pad at "
            f"{known['body.place.at_mm']} mm, the built-in hand, edges of {known['body.edge_mm.near_target']} mm near the target and "
            f"{known['body.edge_mm.far']} mm elsewhere, boxes of "
            + ", ".join(" x ".join(f"{side:g}" for side in box) for box in boxes)
            + f" mm, centred at the pad, {number(float(known['target.pressure_pa']) / 1e3)} kPa. What changing them changes, one at a "
            "time, for the 8 mm box:")


def is_done(work, *parts):
    """Whether every step of these parts was done."""
    return all(stamps and all(stamp["done"] for stamp in stamps) for stamps in (steps_of(work, part) for part in parts))


def lines_of(items):
    return "\n".join(f"- {item}" for item in items)


def seconds_of(work):
    """[(part, seconds)] of the steps, a part being the first folder of a step's name."""
    parts = {}
    for stamp in sorted((work / "steps").glob("*.json")):
        kept = json.loads(stamp.read_text())
        part = stamp.stem.split("-")[0]
        parts[part] = parts.get(part, 0.0) + kept["seconds"]
    return list(parts.items())


class Page:
    """Markdown that grows, with figures numbered."""

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
        """A table of text, and where all of it is."""
        self.tables += 1
        self.add(markdown_table(header, rows))
        self.add(f"*Table {self.tables}, of [tables/{name}](tables/{name}). Made by {origin.caption()}*")

    def text(self):
        return "\n\n".join(self.parts) + "\n"


def html_of(text, folder):
    """One file: pictures as data."""
    body = markdown.markdown(text, extensions=["tables"])
    body = re.sub(r'src="(figures/[^"]+)"', lambda found: 'src="data:image/png;base64,'
                  + base64.b64encode((folder / found[1]).read_bytes()).decode("ascii") + '"', body)
    title = text.splitlines()[0].lstrip("# ")
    return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n<style>{STYLE}</style>\n'
            f"</head>\n<body>\n{body}\n</body>\n</html>\n")


def add_panels(page, work, report):
    names = list(SCENES)
    origin = made(work, "panels")
    panels.figure(work, names, report / "figures/panels.png")
    rows = panels.metric_rows(work, names, "panels")
    write_table(report / "tables/metrics.csv", rows, origin)
    page.add("## Patterns on the skin")
    page.figure("panels.png", "What is wanted, and abs p on the skin by the published method with scattering in the solver, by the same "
                "without, by `surface`, and by a plain focus. Seen from the array (x to the left), the target outlined in white; one "
                "scale of colours a row, from 0 to 1.5 times the largest wanted pressure. Error: relative L2 of abs p over the whole "
                "skin after the best scale; width: of |p|^2 at half of its maximum. Both of the judge that the scene names.", origin)
    page.add(lines_of(panels.sentences(rows, names)))
    page.table("metrics.csv", *panels.short_table(rows), origin)
    page.add("`gap`: how far the method is, provably at most, from the best that any phases can do on `surface`'s cost, for the "
             "matrix that was computed. docs/metrics.md defines the metrics.")
    if (work / "autd3").exists():
        rows, origin = panels.metric_rows(work, names, "autd3"), made(work, "autd3")
        write_table(report / "tables/metrics_autd3.csv", rows, origin)
        channels = size_of(work / "autd3" / names[0])[1]
        page.add(f"### The same on AUTD3 units\n\n{channels:,} transducers as a real array has them (scenes/autd3), whose phases "
                 "`touchfield send` can push to the device.")
        page.add(lines_of(panels.sentences(rows, names)))
        page.table("metrics_autd3.csv", *panels.short_table(rows), origin)


def add_claims(page, work, shares, quick):
    page.add("## What was published, and what is found here")
    page.add(markdown_table(claims.HEADER, claims.rows(
        panels.metric_rows(work, list(SCENES), "panels"), curves.convergence_rows(work), curves.iteration_times(work / "faces"),
        shares, delays.delay_rows(delays.plays(work / "delays", "held")[0], delays.plays(work / "delays", "predicted"),
                                       course.translations(quick)) if is_done(work, "delays") else [])))
    page.add("Every row is explained below. The model has steady sound, a rigid skin, equal transducers, and nothing of what people feel.")


def add_whole_hand(page, work, report):
    rows, origin = whole_hand.finger_rows(work), made(work, "finger", "panels")
    write_table(report / "tables/finger.csv", rows, origin)
    page.add("## What a finger alone would have said\n\nThe published figure shows fingers. Here each finger ends 50 mm from the target, and "
             "nothing else is there: phases are found and judged on it. Then the same phases sound on the whole hand.")
    page.add(lines_of(whole_hand.finger_sentences(rows)))
    page.table("finger.csv", ["scene", "method", "error of the finger alone", "its phases on the hand", "phases of the hand there"],
               [[row["scene"], f"`{row['method']}`", *(percent(value) for value in list(row.values())[2:])] for row in rows], origin)
    rows, origin = whole_hand.arm_rows(work), made(work, "forearm", "panels")
    write_table(report / "tables/forearm.csv", rows, origin)
    page.add("### The arm behind the hand")
    page.add(lines_of(whole_hand.arm_sentences(rows)))
    page.table("forearm.csv", ["scene", "p^2 on the arm, unknown", "known", "error of `surface`, arm unknown", "known", "`paper`, known",
                               "`unscattered`, known"],
               [[row["scene"], *(percent(value) for value in list(row.values())[1:7])] for row in rows], origin)


def add_sequences(page, work, report, quick):
    origin = made(work, "panels/width_8mm")
    rows = sequences.kept_rows(work, quick, origin)
    write_table(report / "tables/sequences.csv", rows, origin)
    page.add("## Several patterns in quick succession\n\nWould skin that feels the mean square of the pressure over a sequence of "
             "patterns be served better by one? For the 8 mm box, sequences from random phases, each improved by limited-memory "
             "BFGS as a whole (scripts/report/sequences.py).")
    page.add(lines_of(sequences.sentences(rows)))
    shown = ["frames", "starts", "cost_pa2m2", "misfit", "above_bound"]
    page.table("sequences.csv", ["patterns", "starts", "least cost [Pa2 m2]", "misfit", "above the bound, as a share of it"],
               [[row[key] for key in shown] for row in rows], origin)


def add_curves(page, work, report):
    page.add("## Convergence")
    origin = made(work, "convergence")
    rows = curves.convergence_rows(work)
    curves.convergence_figure(work, report / "figures/convergence.png")
    write_table(report / "tables/convergence.csv", rows, origin)
    page.figure("convergence.png", "The 8 mm box. Left: cost of each method, above the least it ever reached; each method has a cost of its "
                "own. Right: judged error. Filled marks, thick: from zero. Hollow, thin: from the phases of the frame before, the hand "
                "1 mm away (20 mm/s at the published 20 frames a second). Numbers: [tables/convergence.csv](tables/convergence.csv).",
                origin)
    page.add(lines_of(curves.convergence_sentences(rows)))

    page.add("## Time of an iteration")
    by_faces, by_channels = curves.iteration_times(work / "faces"), curves.iteration_times(work / "parameters")
    curves.times_figure(by_faces, by_channels, report / "figures/iteration_time.png")
    ran = provenance(work / "panels" / "width_8mm")
    page.figure("iteration_time.png", f"Left: against the faces of the body, {by_faces[0]['channels']} transducers. Right: against the "
                f"transducers, {by_channels[0]['faces']} faces. {ran['threads']} threads of a machine that others may use as well "
                f"({curves.processor()}): compare what lies side by side. The published times, 10 ms at 10,000 faces and 1,496 "
                "transducers on an RTX 2080 Ti, are of a graphics card.", made(work, "faces", "parameters"))
    page.add(lines_of(curves.times_sentences(by_faces, by_channels)))
    for name, part, rows in (("iteration_faces", "faces", by_faces), ("iteration_channels", "parameters", by_channels)):
        origin = made(work, part)
        write_table(report / f"tables/{name}.csv", rows, origin)
        page.table(f"{name}.csv", list(rows[0]), [list(row.values()) for row in rows], origin)


def add_study(page, work, report):
    page.add("## Speed against error")
    origin = made(work, "study")
    curves.study_figure(work, report / "figures/speed_error.png")
    (report / "tables/study.csv").write_text(origin.head() + (work / "study" / "study.csv").read_text(), encoding="utf-8")
    page.figure("speed_error.png", "Ways to solve for the pressure of one drive on the skin of the 8 mm scene (`touchfield study`), of its finger alone: scheme, mesh, solver, "
                "precision. Error against the best scheme on a finer mesh than any of them.", origin)
    page.table("study.csv", *curves.study_table(work), origin)


def add_assumptions(page, work, report):
    origin = made(work, "assumptions")
    page.add(f"## What could not be compared\n\n{OPEN} {taken(work)}")
    changes = assumptions.read(work / "assumptions")
    assumptions.figure(changes, report / "figures/assumptions.png")
    header, rows = assumptions.summary(changes)
    write_table(report / "tables/assumptions.csv", [dict(zip([name.replace("`", "") for name in header], row)) for row in rows],
                origin)
    page.figure("assumptions.png", "Judged error and rendered width of the 8 mm box when one thing changes. The red line: the width that is "
                "wanted in the scene as shipped, faces' edges included.", origin)
    page.add(lines_of(assumptions.sentences(changes)))
    page.table("assumptions.csv", header, rows, origin)


def add_widths(page, work, report, trials, result):
    origin = made(work, "hands")
    widths.write_tables(result, report / "tables", origin)
    widths_figure.figure(result, trials, report / "figures/widths.png")
    breadths, lengths = zip(*trials.sizes.values())
    page.add("## Can the widths be told apart?")
    page.add("The published study asked people to tell 5, 8 and 11 mm apart: 0.56 correct with scattering in the solver, 0.47 without, "
             f"chance 0.33 (Wilcoxon p < 0.05). Here {len(trials.sizes)} built-in hands, {min(breadths):g} to {max(breadths):g} mm broad and "
             f"{min(lengths):g} to {max(lengths):g} mm long, are seen by a simulated depth camera: noise along the normal of "
             f"{trials.noise.min():.2f} to {trials.noise.max():.2f} mm rms, correlated over {trials.correlation_mm:g} mm, and "
             f"{trials.offset_mm_rms:.2f} mm rms of misplacement along an axis. Phases are found on what the camera saw; what then presses "
             "on the true skin is given to observers, each taught on the other hands: one reads the width at half maximum; one is the "
             "ideal one for patterns that vary as these do, with noise of its own; one is the same where every pattern was first brought "
             "to the same mean level, since a louder pattern stands out of the noise whatever its shape.")
    page.figure("widths.png", "Share correct by observer and method, the ideal observer's share against its own noise, what is taken for what, "
                f"and the mean profiles. Intervals: 95 %, of {widths_words.covered(result)}, not of people; the ideal observers' noise fitted "
                "anew to each. Numbers: " + ", ".join(f"[{name}](tables/{name}.csv)" for name in (
                    "widths", "widths_confusion", "widths_wilcoxon", "widths_sigma", "widths_fit", "widths_noise")) + ".", origin)
    page.add(lines_of(widths_words.sentences(result)))


DELAYS = "## How much delay there is and what it does"
CAMERAS = "## What it costs that cameras see the hand"
ARRAYS = "## Patterns in time, tolerances and other arrays"
AGAIN = "## Again"


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
    page.add(f"{DELAYS}\n\nThe 8 mm box on a finger that moves through the place of the scenes above, 200 mm above the array, at "
             "constant velocity or shaking across itself; phases are found on a mesh of some 570 faces (scenes/moving.yaml), errors judged on "
             "the whole hand. Every score counts with the age of the sample that its phases are of. Without prediction frames are "
             "held for 200 ms, 30 steps each, so that one play has every age; with it, and of tremor, frames come at 20 Hz, 10 steps "
             "each, of a sensor at 30 Hz, and solving takes no time: the delay is the array's. Noise of the sensor is new in every sample; "
             "results/tables/prediction_gain.csv (scripts/prediction_study) has what cameras see, at more speeds and delays.")
    page.figure("delays.png", "Judged error against the age of the sample that the phases are of. Dashed: with `predict: linear`; dotted: with `kalman`. Numbers: "
                + ", ".join(f"[{name}](tables/{name}.csv)" for name in tables) + ".", origin)
    page.add(lines_of([*delays.answer_sentences(tables["delays_answers"]),
                       *delays.prediction_sentences(tables["delays"], tables["delays_tremor"]),
                       *delays.noise_sentences(tables["delays_noise"]),
                       *delays.loop_sentences(tables["delays_loop"]), delays.reference_sentence(by_displacement)]))
    shown = {"speed_mm_s": "mm/s", "array_ms": "delay of the array [ms]", "age_ms_mean": "mean age [ms]",
             "displacement_mm_mean": "mean displacement [mm]", "error_mean": "mean error", "error_p95": "95 %"}
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
    page.add(f"{CAMERAS}\n\nThe hand of scenes/cameras.yaml, which sways at up to 50 mm/s while its finger flexes, is seen by depth cameras; the "
             "built-in hand, its shape learnt from the first second, is fitted to their images (docs/cameras.md), phases are found on the "
             "fitted skin of some 570 faces and the incident pressure beyond it, and judged on the whole true hand. Nothing is late here, so that what is left above the exact "
             "sensor is what seeing costs. The cameras are simulated: their noise is independent from image to image, and they know "
             "where they stand unless a row says otherwise.")
    page.figure("cameras.png", "Judged error (mean and 95 %) against what is changed of the sensor. Grey: the skin known exactly. Squares: how far the skin about the target is off.",
                origin)
    population = table(cameras.POPULATION)
    page.add(cameras.population_sentence(population))
    page.add(markdown_table(["cameras", "hands", "found", "wrong", "seen skin [mm]", "farthest fingertip [mm]"],
                            [[row["cameras"], row["name"], percent(row["found"]), percent(row["wrong"]), row["skin_mm"], row["tip_mm"]]
                             for row in population]))
    page.add(lines_of(cameras.sentences(rows, table(noise) if noise.exists() else [])))
    page.table("cameras.csv", ["sensor", "value", "hand", "lost", "skin [mm]", "at the target [mm]", "mean error", "95 %", "above [points]"],
               [[row["sensor"], row["value"], row["hand"], f"{row['lost']} of {row['frames']}", number(row["skin_mm"], 2),
                 number(row["patch_mm"], 2), percent(row["error_mean"]), percent(row["error_p95"]), cameras.points(row)] for row in rows],
               origin)


def add_arrays(page, work, report, quick):
    page.add(ARRAYS)
    for text in arrays.texts():
        page.add(text)


# Parts that can be put in by themselves, in order.
LAST = {"delays": (DELAYS, add_delays), "cameras": (CAMERAS, add_cameras), "arrays": (ARRAYS, add_arrays)}
KEPT = {"arrays"}  # made of kept tables, without steps


def write_report(work, report, quick):
    """Writes report.md, report.html, figures/ and tables/ into `report` from the runs in `work`."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for part in ("figures", "tables"):
        (report / part).mkdir(parents=True, exist_ok=True)
    ran = provenance(work / "panels" / "width_8mm")
    page = Page()
    page.add("# Pressure patterns on the skin of a hand: the published analysis, reproduced and carried further")
    if quick:
        page.add("**A quick rehearsal: coarse meshes, an eighth of the transducers, few cases. Its numbers mean nothing.**")
    page.add("The study: Matsubayashi, Makino, Shinoda, EuroHaptics 2020, doi 10.1007/978-3-030-58147-3_45. Methods: "
             "`paper`, its optimisation, on this program's model of scattering; `unscattered`, its comparison, as if the hand did not "
             "scatter; both with faces weighed by area, since the mesh is finer about the target; `paper_original` and "
             "`unscattered_original`, faces alike and the model of scattering as it was published; `surface`, this program's; `focus`, "
             "phase conjugation. Definitions: docs/theory.md, docs/metrics.md.")
    revisions = made(work, *{stamp.stem.split("-")[0] for stamp in (work / "steps").glob("*.json")}).revisions
    page.add(f"Computed by touchfield {ran['version']} ({' and '.join(revisions)}) with {ran['threads']} threads on "
             f"{curves.processor()}." + ("" if len(revisions) == 1 else " **Of several revisions: the captions say what is of which.**"))
    trials = widths_trials.load(work / "hands") if is_done(work, "hands") else None
    result = widths.analyse(trials) if trials else None
    shares = [{"observer": score.observer, "method": score.method, "share": score.share} for score in result.scores] if result else []
    add_claims(page, work, shares, quick)
    add_panels(page, work, report)
    add_whole_hand(page, work, report)
    add_sequences(page, work, report, quick)
    add_curves(page, work, report)
    later = {"study": ("speed against error", lambda: add_study(page, work, report)),
             "assumptions": ("what could not be compared", lambda: add_assumptions(page, work, report)),
             "hands": ("whether the widths can be told apart", lambda: add_widths(page, work, report, trials, result))}
    later |= {part: (title.lstrip("# ").lower(), lambda add=add: add(page, work, report, quick)) for part, (title, add) in LAST.items()}
    there = {part for part in later if part in KEPT or is_done(work, part)}
    for part, (_, add) in later.items():
        if part in there:
            add()
    missing = [words for part, (words, _) in later.items() if part not in there]
    if missing:
        page.add(f"## Not computed\n\nOf this revision, not yet: {'; '.join(missing)}. `scripts/reproduce` goes on with it.")
    page.add(f"{AGAIN}\n\n`scripts/reproduce` computes all of this (seeds are in the scenes and sweeps), `--quick` a small version of it, "
             "`--report-only` the report of what is there.")
    parts = seconds_of(work)
    page.add(markdown_table(["part", "seconds"], [[name, f"{seconds:.0f}"] for name, seconds in parts]
                            + [["all", f"{sum(seconds for _, seconds in parts):.0f}"]]))
    write_page(page.text(), report)


def write_page(text, report):
    (report / "report.md").write_text(text, encoding="utf-8")
    (report / "report.html").write_text(html_of(text, report), encoding="utf-8")


def refresh(part, work, report, quick):
    """Puts one of the last parts, before what tells how to compute all again, into the report that is there, or a new one."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for folder in ("figures", "tables"):
        (report / folder).mkdir(parents=True, exist_ok=True)
    kept = (report / "report.md").read_text(encoding="utf-8") if (report / "report.md").exists() else f"# {part.capitalize()} alone\n"
    title, add = LAST[part]
    own = kept.find(f"{title}\n")
    later = [kept.find(f"{name}\n") for name in [*(other for other, _ in LAST.values()), AGAIN]]
    end = min((at for at in later if at > max(own, 0) and at >= 0), default=len(kept))
    if own < 0:  # it comes before the parts that follow it
        follows = list(LAST)[list(LAST).index(part) + 1:]
        own = end = min((at for at in (kept.find(f"{name}\n") for name in [*(LAST[other][0] for other in follows), AGAIN]) if at >= 0),
                        default=len(kept))
    before, after = kept[:own], kept[end:]
    page = Page()
    page.figures, page.tables = (max((int(found) for found in re.findall(rf"^\*{kind} (\d+)", before, re.M)), default=0)
                                 for kind in ("Figure", "Table"))
    add(page, work, report, quick)
    write_page(before.rstrip("\n") + "\n\n" + page.text() + (f"\n{after}" if after else ""), report)
