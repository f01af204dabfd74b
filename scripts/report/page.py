"""Writes the report: tables from the runs, pictures from the tables, and the numbers and tables of its page."""

import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import cameras
import claims
import course
import delays
import panels
import pictures
import sequences
import tables
import widths
import widths_trials
from runs import SCENES, Made, made, revision_of, steps_of, table, write_table

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "results/study/report.md"
MARK = re.compile(r"(<!-- (table|value): (?:(?!-->).)*?-->).*?(<!-- /\2 -->)", re.DOTALL)
QUICK = "**This is a rehearsal with coarse meshes, a small array and few cases. Its numbers mean nothing, and its text is that of the full study.**"


def delay_tables(work, quick):
    segments, folder = course.translations(quick), work / "delays"
    (held,), predicted = delays.plays(folder, "held"), delays.plays(folder, "predicted")
    by_displacement = delays.displacement_rows(held, segments)
    return {"delays": delays.delay_rows(held, predicted, segments), "delays_by_displacement": by_displacement,
            "delays_answers": delays.answer_rows(by_displacement),
            "delays_tremor": delays.tremor_rows(delays.plays(folder, "tremor"), course.tremors(quick)),
            "delays_loop": delays.loop_rows(delays.plays(folder, "loop"))}


# (parts of the reproduction, the tables that are made from their runs)
TABLES = [
    (["panels"], lambda work, quick: {"metrics": panels.metric_rows(work, list(SCENES), "panels"),
                                      "sequences": sequences.kept_rows(work, quick, made(work, "panels"))}),
    (["autd3"], lambda work, quick: {"metrics_autd3": panels.metric_rows(work, list(SCENES), "autd3")}),
    (["finger", "panels"], lambda work, quick: {"finger": tables.finger_rows(work)}),
    (["hand_alone", "panels"], lambda work, quick: {"forearm": tables.arm_rows(work)}),
    (["convergence"], lambda work, quick: {"convergence": tables.convergence_rows(work)}),
    (["times"], lambda work, quick: {"iteration_faces": tables.iteration_times(work / "times/faces"),
                                     "iteration_channels": tables.iteration_times(work / "times/transducers")}),
    (["hands"], lambda work, quick: widths.tables(widths.analyse(widths_trials.load(work / "hands")))),
    (["delays"], delay_tables),
    (["cameras"], lambda work, quick: {"cameras": cameras.rows_of(work / "cameras", quick)}),
    (["assumptions"], lambda work, quick: {"assumptions": tables.assumption_rows(work / "assumptions")})]


def is_done(work, *parts):
    """Whether all steps of these parts are done."""
    return all(stamps and all(stamp["done"] for stamp in stamps) for stamps in (steps_of(work, part) for part in parts))


def step_rows(work):
    """Seconds and revision of each part. The part is the first folder in the name of a step."""
    stamps = [(path.stem.split("-")[0], json.loads(path.read_text())) for path in sorted((work / "steps").glob("*.json"))]
    return [{"part": part, "seconds": f"{sum(stamp['seconds'] for own, stamp in stamps if own == part):.0f}",
             "revision": " and ".join(sorted({revision_of(stamp["version"]) for own, stamp in stamps if own == part}))}
            for part in dict.fromkeys(part for part, _ in stamps)]


def write_claims(folder, command):
    kept = {path.stem: path for path in sorted(folder.glob("*.csv")) if path.stem in {name for name, *_ in claims.CLAIMS}}
    heads = [path.read_text().partition("\n")[0] for path in kept.values()]
    revisions = sorted({revision for head in heads for revision in re.search(r"revision: ([^;]+)", head)[1].split(" and ")})
    origin = Made(command, revisions, {path.name: hashlib.sha256(path.read_bytes()).hexdigest()[:12] for path in kept.values()})
    write_table(folder / "claims.csv", claims.rows({name: table(path) for name, path in kept.items()}), origin)


def fill_page(report, quick):
    """Fills the marks of the page from the tables of the report, as scripts/figures does; a mark without a number gets a dash."""
    text = PAGE.read_text(encoding="utf-8")
    if report != PAGE.parent:
        text = MARK.sub(lambda found: found[1] + ("-" if found[2] == "value" else "\n-\n") + found[3], text)
    if quick:
        text = text.replace("\n\n", f"\n\n{QUICK}\n\n", 1)
    (report / "report.md").write_text(text, encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        (root / "results").mkdir()
        (root / "results/study").symlink_to(report)
        (root / "results/tables").symlink_to(ROOT / "results/tables")
        done = subprocess.run([ROOT / "scripts/figures", "--root", root], capture_output=True, text=True, check=False)
    if done.returncode != 0 and not quick:
        print(done.stdout, end="", file=sys.stderr)


def write_report(work, report, quick, only=None):
    """Writes tables/, figures/ and report.md into `report`: from the finished runs in `work`, otherwise from its own tables."""
    work, report = pathlib.Path(work), pathlib.Path(report)
    for part in ("figures", "tables"):
        (report / part).mkdir(parents=True, exist_ok=True)
    for parts, rows_of in TABLES:
        if only not in (None, *parts):
            continue
        if not is_done(work, *parts):
            print(f"{parts[0]}: not finished; the report keeps its former results, if any", file=sys.stderr)
            continue
        for name, rows in rows_of(work, quick).items():
            write_table(report / f"tables/{name}.csv", rows, made(work, *parts))
        if parts == ["panels"]:
            panels.figure({name: work / "panels" / name for name in SCENES}, report / "figures/panels.png")
    if steps := step_rows(work):
        write_table(report / "tables/steps.csv", steps, made(work, *(row["part"] for row in steps)))
    write_claims(report / "tables", "scripts/reproduce" + " --quick" * quick)
    pictures.draw(report / "tables", report / "figures")
    fill_page(report, quick)
