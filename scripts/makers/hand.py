"""The built-in hand: tables of the bench about large bodies and the skin beyond."""

import csv
import statistics

from work import ROOT, listed, sets

POSES = ["flat", "index_up", "grasp", "point_down", "fist"]
# Pose, edge near the index fingertip [mm], edge elsewhere or 0, forearm.
BODIES = [(pose, edge, 0, 0) for pose in POSES for edge in (4.5, 2.2, 1.36, 0.97, 0.72)] + [("index_up", 1.2, 6.5, 0), ("index_up", 0.6, 3, 0)]
BODIES += [("index_up", 1.2, 6.5, 250), ("index_up", 3.2, 0, 250), ("index_up", 1.6, 0, 250), ("grasp", 1.6, 0, 250)]


def large(work):
    """A pose without a mesh of an edge length is left out."""
    for body in BODIES:
        try:
            yield from csv.DictReader(work.bench("large_bodies", *body).splitlines())
        except RuntimeError as error:
            print(error, flush=True)


NEAR, FAR = 1.2, 6.5
# What changes, near [mm], far [mm], kept [mm] (0: the whole hand).
SETTINGS = [("finest", 1.0, 3.5, 0), ("default", NEAR, FAR, 0), *(("near", near, FAR, 0) for near in (0.8, 1.6, 2.4)),
            *(("far", NEAR, far, 0) for far in (5, 8, 12)), *(("kept", NEAR, FAR, kept) for kept in (30, 40, 50, 80))]
CHOSEN = [("width_8mm", []), ("penetration", [])]
HELD_OUT = [("width_8mm", ["body.hand={pose: flat}", "body.place={landmark: palm_centre, at_mm: [0, 0, 150]}", "target.box={at: palm_centre, size_mm: [12, 12, 6]}"]),
            ("width_8mm", ["body.hand={pose: point_down}", "body.place.at_mm=[0, 0, 100]"]), ("width_8mm", ["body.place.at_mm=[20, 10, 300]"])]


def beyond(work):
    """One row per setting: errors above the finest solution of the scene, of scenes that chose the defaults and of others that test them."""
    given = work.runs / "settings"
    given.write_text("".join(f"{near} {far} {kept}\n" for _, near, far, kept in SETTINGS))
    above, seconds = {}, [[] for _ in SETTINGS]
    for label, scenes in (("chosen", CHOSEN), ("held_out", HELD_OUT)):
        above[label] = [[] for _ in SETTINGS]
        for scene, changes in scenes:
            with given.open() as settings:
                printed = work.bench("beyond_study", ROOT / f"scenes/{scene}.yaml", *sets([listed("surface"), "field=[]", *changes]), stdin=settings)
            lines = list(csv.DictReader(printed.splitlines()))
            for number, line in enumerate(lines):
                above[label][number].append(float(line["relative_error"]) - float(lines[0]["relative_error"]))  # the first is the finest
                seconds[number].append(float(line["seconds"]))
    return [{"factor": what, "near_mm": near, "far_mm": far, "kept_mm": kept or "whole"}
            | {f"{label}_{name}": f"{of(own[number]):.5f}" for label, own in above.items() for name, of in (("median", statistics.median), ("worst", max))}
            | {"seconds": f"{statistics.median(seconds[number]):.3g}"} for number, (what, near, far, kept) in enumerate(SETTINGS)]
