"""Runs, sweeps and studies as they lie on the disk, read for the report; and how a method looks in every figure."""

import csv
import dataclasses
import functools
import pathlib

import h5py
import numpy

SCENES = {"width_5mm": "5 mm box", "width_8mm": "8 mm box", "width_11mm": "11 mm box", "grasp": "grasped box",
          "penetration": "penetration depth"}
LABELS = {"surface": "surface (ours)", "paper": "paper (with scattering)",
          "paper_original": "paper on its own model", "unscattered": "unscattered (without)", "focus": "focus"}
# Told apart by marker and line in grey as well.
STYLES = {"surface": {"color": "#0072B2", "marker": "o", "linestyle": "-"},
          "paper": {"color": "#D55E00", "marker": "s", "linestyle": "--"},
          "paper_original": {"color": "#E69F00", "marker": "D", "linestyle": "-."},
          "unscattered": {"color": "#000000", "marker": "^", "linestyle": ":"},
          "focus": {"color": "#888888", "marker": "x", "linestyle": (0, (1, 3))}}
METRICS = ["relative_error", "relative_error_raw", "scale", "correlation", "leakage", "mean_inside_pa", "cv_inside",
           "width_mm", "width_wanted_mm", "peak_pa", "force_target_n", "force_elsewhere_n", "cost", "cost_skin",
           "cost_bound", "optimality_gap", "iterations", "seconds_solve", "judge_difference"]


@dataclasses.dataclass
class Skin:
    """What the judge saw: triangles [M, 3, 3] in m, area [M] in m2, wanted abs p [M] in Pa, abs p [M] of every method."""

    corners: numpy.ndarray
    triangles: numpy.ndarray
    area: numpy.ndarray
    wanted: numpy.ndarray
    pressure: dict

    @functools.cached_property
    def normals(self):
        cross = numpy.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        return cross / numpy.linalg.norm(cross, axis=1, keepdims=True)


def attributes(folder):
    """{method: {attribute: value}} of a run, in the order of the scene."""
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        return {name: dict(method.attrs) for name, method in run["methods"].items()}


def costs(folder):
    """{method: cost before the first and after each iteration} of a run."""
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        return {name: method["cost"][:] for name, method in run["methods"].items() if "cost" in method}


def skin(folder):
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        judge = run["judge"]
        triangles = judge["mesh/triangles"][:]
        wanted = numpy.zeros(len(triangles))
        wanted[judge["target/face"][:]] = judge["target/amplitude"][:]
        return Skin(judge["mesh/vertices"][:][triangles], triangles, judge["mesh/area"][:], wanted,
                    {name: numpy.abs(method["pressure"][:]) for name, method in judge["methods"].items()})


def size_of(folder):
    """Faces of the solving mesh, channels, target faces."""
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        return len(run["mesh/area"]), len(run["array/amplitude"]), len(run["target/face"])


def provenance(folder):
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        return dict(run["provenance"].attrs)


def table(path):
    """Rows of a CSV file as dictionaries."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def cases(folder):
    """Folders of a sweep's cases that are whole, in order."""
    return [case for case in sorted(pathlib.Path(folder).glob("cases/*")) if (case / "run.h5").exists()]


def write_table(path, rows):
    """Dictionaries with the same keys as CSV."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def number(value, digits=3):
    """A number as a reader wants it: `digits` significant ones, a dash for what is not there."""
    value = float(value)
    return "-" if value != value else f"{value:.{digits}g}" if value == 0 or abs(value) < 1e5 else f"{value:.2e}"


def percent(value, digits=1):
    value = float(value)
    return "-" if value != value else f"{100 * value:.{digits}f} %"


def markdown_table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])
