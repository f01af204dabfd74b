"""The report: figures, tables, Markdown, and one HTML page with everything inside."""

import base64
import json
import pathlib
import re
import shutil

import markdown

import assumptions
import curves
import panels
import widths
import widths_figure
from runs import SCENES, markdown_table, provenance, write_table

STYLE = """body { max-width: 62em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #111; background: #fff; }
img { max-width: 100%; } table { border-collapse: collapse; font-size: 85%; display: block; overflow-x: auto; }
th, td { border: 1px solid #bbb; padding: .2em .5em; text-align: left; } code { background: #f2f2f2; }"""

OPEN = """The published study does not say how fast sound was taken to be, how the transducers' directivity and amplitude were
modelled, where the array was, how high the finger was above it, which mesh the hand had, how strong and how long the boxes
were. Taken here: 343.2 m/s (20 C), the measured directivity of the T4010A1, 4.386 Pa m a transducer, a flat array of 44 x 34 (1,496
transducers, 10.16 mm apart) at z = 0, the pad 200 mm above its middle, the built-in hand, edges of 1.2 mm near the target
and 3 mm elsewhere, the skin within 50 mm of the target, boxes of 5 x 12, 8 x 8 and 11 x 6 mm, 6 mm deep and centred at the pad,
15 kPa. What changing them changes, one at a time, for the 8 mm box:"""


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

    def add(self, text):
        self.parts.append(text)

    def figure(self, name, caption):
        self.figures += 1
        self.add(f"![Figure {self.figures}](figures/{name})\n\n*Figure {self.figures}. {caption}*")

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
    panels.figure(work, names, report / "figures/panels.png")
    rows = panels.metric_rows(work, names, "panels")
    write_table(report / "tables/metrics.csv", rows)
    page.add("## Patterns on the skin")
    page.figure("panels.png", "What is wanted, and abs p on the skin by the published method with scattering in the solver, by the same "
                "without, by `surface`, and by a plain focus. Seen from the array (x to the left), the target outlined in white; one "
                "scale of colours a row, from 0 to 1.5 times the largest wanted pressure. Error: relative L2 of abs p over the whole "
                "skin after the best scale; width: of |p|^2 at half of its maximum. Both of the judge, the most exact scheme on "
                "another, finer mesh.")
    page.add(lines_of(panels.sentences(rows, names)))
    page.add(markdown_table(*panels.short_table(rows)))
    page.add("`gap`: how far the method is, provably at most, from the best that any phases can do on `surface`'s cost. All metrics "
             "(docs/metrics.md defines them): [tables/metrics.csv](tables/metrics.csv).")
    if (work / "autd3").exists():
        rows = panels.metric_rows(work, names, "autd3")
        write_table(report / "tables/metrics_autd3.csv", rows)
        page.add("### The same on six AUTD3 units\n\n1,494 transducers as a real array has them (scenes/autd3), whose phases "
                 "`touchfield send` can push to the device.")
        page.add(lines_of(panels.sentences(rows, names)[:4]))
        page.add(markdown_table(*panels.short_table(rows)))


def add_curves(page, work, report):
    page.add("## Convergence")
    curves.convergence_figure(work, report / "figures/convergence.png")
    write_table(report / "tables/convergence.csv", curves.convergence_rows(work))
    page.figure("convergence.png", "The 8 mm box. Left: cost of each method, above the least it ever reached; each method has a cost of its "
                "own. Right: judged error. Filled marks, thick: from zero. Hollow, thin: from the phases of the frame before, the hand "
                "1 mm away (20 mm/s at the published 20 frames a second).")
    page.add(lines_of(curves.convergence_sentences(work)))

    page.add("## Time of an iteration")
    by_faces = curves.iteration_times(work / "faces")
    by_channels = curves.iteration_times(work / "parameters")
    curves.times_figure(by_faces, by_channels, report / "figures/iteration_time.png")
    write_table(report / "tables/iteration_faces.csv", by_faces)
    write_table(report / "tables/iteration_channels.csv", by_channels)
    ran = provenance(work / "panels" / "width_8mm")
    page.figure("iteration_time.png", f"Left: against the faces of the body, 1,496 transducers. Right: against the transducers, a "
                f"fingertip. {ran['threads']} threads of a shared machine ({curves.processor()}): a figure may be off by a third. The "
                "published times, 10 ms at 10,000 faces and 1,496 transducers on an RTX 2080 Ti, are of a graphics card.")
    page.add("An iteration of either method does not see the faces: `paper` pays them once in its Gram matrix, `surface` in the transfer "
             "matrix (columns `paper_once_s`, `surface_once_s`).")
    for rows in (by_faces, by_channels):
        page.add(markdown_table(list(rows[0]), [list(row.values()) for row in rows]))

    page.add("## Speed against error")
    curves.study_figure(work, report / "figures/speed_error.png")
    shutil.copyfile(work / "study" / "study.csv", report / "tables/study.csv")
    page.figure("speed_error.png", "Ways to solve for the pressure of one drive on the skin of the 8 mm scene (`touchfield study`): scheme, mesh, solver, "
                "precision. Error against the best scheme on a finer mesh than any of them.")
    page.add(markdown_table(*curves.study_table(work)))


def add_assumptions(page, work, report):
    page.add("## What could not be compared\n\n" + OPEN)
    changes = assumptions.read(work / "assumptions")
    assumptions.figure(changes, report / "figures/assumptions.png")
    header, rows = assumptions.summary(changes)
    write_table(report / "tables/assumptions.csv", [dict(zip([name.replace("`", "") for name in header], row)) for row in rows])
    page.figure("assumptions.png", "Judged error and rendered width of the 8 mm box when one thing changes. The red line: the width that is "
                "wanted, faces' edges included.")
    page.add(lines_of(assumptions.sentences(changes)))
    page.add(markdown_table(header, rows))


def add_widths(page, work, report):
    trials = widths.load(work / "hands")
    result = widths.analyse(trials)
    widths.write_tables(result, report / "tables")
    widths_figure.figure(result, trials, report / "figures/widths.png")
    page.add("## Can the widths be told apart?")
    page.add("The published study asked people to tell 5, 8 and 11 mm apart: 0.56 correct with scattering in the solver, 0.47 without, "
             f"chance 0.33 (Wilcoxon p < 0.05). Here hands of {len(set(trials.hand))} sizes (the published means of men and women, "
             "0.92 to 1.08 of their size) are seen by a simulated depth camera: noise along the normal of 0.25 to 1 mm rms, correlated over 5 mm, and "
             "0.5 mm of misplacement along each axis. Phases are found on what the camera saw; what then presses on the true skin is "
             "given to observers, each taught on the other hands: one reads the width at half maximum; one is the ideal one "
             "for patterns that vary as these do, with noise of its own; one is the same where every pattern was first brought to "
             "the same mean level, since a louder pattern stands out of the noise whatever its shape.")
    page.figure("widths.png", "Share correct by observer and method, the ideal observer's share against its own noise, what is taken for what, "
                "and the mean profiles.")
    page.add(lines_of(widths.sentences(result)))


def write_report(work, report, quick):
    """Writes report.md, report.html, figures/ and tables/ into `report` from the runs in `work`."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for part in ("figures", "tables"):
        (report / part).mkdir(parents=True, exist_ok=True)
    ran = provenance(work / "panels" / "width_8mm")
    page = Page()
    page.add("# Pressure patterns on the skin of a hand: the published analysis, reproduced and carried further")
    if quick:
        page.add("**A quick rehearsal: coarse meshes, a quarter of the transducers, few cases. Its numbers mean nothing.**")
    page.add("The study: Matsubayashi, Makino, Shinoda, EuroHaptics 2020, doi 10.1007/978-3-030-58147-3_45. Methods: "
             "`paper`, its optimisation, on this program's model of scattering; `paper_original`, the same on the model of scattering "
             "as it was published; `unscattered`, its comparison, as if the hand did not scatter; `surface`, this program's; `focus`, "
             "phase conjugation. Definitions: docs/theory.md, docs/metrics.md.")
    page.add(f"Computed by touchfield {ran['version']} ({ran['revision']}) with {ran['threads']} threads on {curves.processor()}.")
    add_panels(page, work, report)
    add_curves(page, work, report)
    add_assumptions(page, work, report)
    add_widths(page, work, report)
    page.add("## Again\n\n`scripts/reproduce` computes all of this (seeds are in the scenes and sweeps), `--quick` a small version of it, "
             "`--report-only` the report of what is there.")
    parts = seconds_of(work)
    page.add(markdown_table(["part", "seconds"], [[name, f"{seconds:.0f}"] for name, seconds in parts]
                            + [["all", f"{sum(seconds for _, seconds in parts):.0f}"]]))
    text = page.text()
    (report / "report.md").write_text(text, encoding="utf-8")
    (report / "report.html").write_text(html_of(text, report), encoding="utf-8")
