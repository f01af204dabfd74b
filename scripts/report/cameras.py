"""Effect of camera errors, from plays of one motion with several sensors."""

import pathlib

import h5py
import numpy

import sights
from runs import table


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
