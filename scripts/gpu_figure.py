#!/usr/bin/python3 -I
"""Draws docs/images/gpu_iteration.png from results/tables/gpu_phases.csv: time of one iteration of `paper` by faces and by channels.

usage: scripts/gpu_figure.py
"""

import pathlib
import sys

if {"-h", "--help"} & set(sys.argv[1:]):
    print(__doc__, end="")
    sys.exit()
ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts/report"))

import matplotlib  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from runs import STYLES, table  # noqa: E402

STEPS = 5
WHOLE, NEEDS = "paper, five steps and what they need", "paper, what they need"
STUDY = {"r": 10_000, "n": 1496}  # the study reports STUDY_MS per iteration for this size
STUDY_MS = 10
LINES = [("processor_ms", "this program on the processor", STYLES["unscattered"]),
         ("card_ms", "this program on the graphics card", STYLES["surface"]),
         ("steps_ms", "the step alone, on the graphics card", STYLES["focus"])]

rows = {}
for row in table(ROOT / "results/tables/gpu_phases.csv"):
    if row["work"] in (WHOLE, NEEDS):
        rows.setdefault((int(row["r"]), int(row["n"])), {})[row["work"]] = row
found = [{"r": faces, "n": channels, "processor_ms": float(of[WHOLE]["processor_ms"]) / STEPS, "card_ms": float(of[WHOLE]["card_ms"]) / STEPS,
          "steps_ms": (float(of[WHOLE]["card_ms"]) - float(of[NEEDS]["card_ms"])) / STEPS} for (faces, channels), of in rows.items()]
same_faces = [of for of in found if sum(other["r"] == of["r"] for other in found) > 1]
same_channels = [of for of in found if of["n"] == STUDY["n"]]

drawing, panels = pyplot.subplots(1, 2, figsize=(12, 4.4), layout="constrained", sharey=True)
for axes, key, of, label in ((panels[0], "r", same_channels, f"number of faces ({STUDY['n']:,} channels)"),
                             (panels[1], "n", same_faces, f"number of channels ({same_faces[0]['r']:,} faces)")):
    of.sort(key=lambda one: one[key])
    for column, name, style in LINES:
        axes.plot([one[key] for one in of], [one[column] for one in of], **style, label=name)
    axes.plot(STUDY[key], STUDY_MS, "*", color="#D55E00", markersize=14, label="the published program")
    axes.set_xlabel(label)
    axes.set_yscale("log")
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)
panels[0].set_ylabel("time per iteration [ms]")
panels[0].legend(loc=(0.42, 0.48))  # between the curves
drawing.savefig(ROOT / "docs/images/gpu_iteration.png", dpi=90, metadata={"Software": None})
