"""Reads runs, sweeps and studies for the report. Each method looks the same in all figures."""

import csv
import dataclasses
import hashlib
import json
import pathlib
import re
import types

import h5py
import numpy

SCENES = {"width_5mm": "5 mm box", "width_8mm": "8 mm box", "width_11mm": "11 mm box", "grasp": "grasped box",
          "penetration": "penetration depth"}
LABELS = {"surface": "surface (ours)", "radiation": "radiation (ours, for P)", "paper": "paper (with scattering)",
          "paper_original": "paper as published", "unscattered": "unscattered (without)",
          "unscattered_original": "unscattered as published", "focus": "focus"}
# Marker and line distinguish the methods in grey too.
STYLES = {"surface": {"color": "#0072B2", "marker": "o", "linestyle": "-"},
          "radiation": {"color": "#009E73", "marker": "P", "linestyle": (0, (6, 1.5))},
          "paper": {"color": "#D55E00", "marker": "s", "linestyle": "--"},
          "paper_original": {"color": "#E69F00", "marker": "D", "linestyle": "-."},
          "unscattered": {"color": "#000000", "marker": "^", "linestyle": ":"},
          "unscattered_original": {"color": "#56B4E9", "marker": "v", "linestyle": (0, (3, 1, 1, 1))},
          "focus": {"color": "#888888", "marker": "x", "linestyle": (0, (1, 3))}}
METRICS = ["relative_error", "relative_error_raw", "scale", "correlation", "leakage", "mean_inside_pa", "cv_inside",
           "width_mm", "width_wanted_mm", "length_wanted_mm", "peak_pa", "relative_error_radiation", "width_radiation_mm",
           "length_radiation_mm", "force_target_n", "force_elsewhere_n", "abs_force_elsewhere_n", "loudest_elsewhere", "cost",
           "cost_skin", "cost_bound", "optimality_gap", "optimality_gap_radiation", "iterations", "seconds_solve", "evaluation_difference",
           "evaluation_difference_target"]


def results(folder):
    """{method: its attributes, with sizes, seconds and the course of its cost} of a run, in the order of the scene."""
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        common = {"faces": len(run["mesh/area"]), "channels": len(run["array/amplitude"])}
        common["target_faces"] = len(run["target/face"]) if "target" in run else 0
        common["threads"] = run["provenance"].attrs["threads"]
        common |= {f"stage_{name}": value for name, value in run["seconds"].attrs.items()}
        found = {}
        for name, method in run["methods"].items():
            found[name] = common | dict(method.attrs) | {"method": name}
            if "cost" in method:
                found[name]["costs"] = method["cost"][:]
            if f"evaluation/methods/{name}/radiation" in run:
                found[name]["peak_radiation_pa"] = run[f"evaluation/methods/{name}/radiation"][:].max()
        return found


def skin(folder):
    """The evaluation mesh with wanted pressures and those of each method [Pa], of the absolute and of the radiation pressure P.

    `corners` are in m; `normals` look out.
    """
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        evaluation = run["evaluation"]
        triangles = evaluation["mesh/triangles"][:]
        corners = evaluation["mesh/vertices"][:][triangles]
        normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        face, share, amplitude = (evaluation[f"target/{name}"][:] for name in ("face", "share", "amplitude"))
        wanted, wanted_radiation = numpy.zeros((2, len(triangles)))
        wanted[face] = share * amplitude
        wanted_radiation[face] = run.attrs["radiation_per_square"] * share * amplitude**2
        return types.SimpleNamespace(
            triangles=triangles, corners=corners, normals=normals / numpy.linalg.norm(normals, axis=1, keepdims=True),
            wanted=wanted, pressure={name: numpy.abs(method["pressure"][:]) for name, method in evaluation["methods"].items()},
            wanted_radiation=wanted_radiation, radiation={name: method["radiation"][:] for name, method in evaluation["methods"].items()})


def scene_of(run):
    """The text of the scene in an open run.h5, with all defaults."""
    return run["scene"][()].decode()


def setting(scene, path):
    """The text of a value in such a scene, or None. `path` has keys only, without indices of lists."""
    keys, depth = path.split("."), 0
    for line in scene.splitlines():
        level = (len(line) - len(line.lstrip())) // 2
        key, _, value = line.strip().partition(":")
        if level < depth:
            return None
        if level == depth and key == keys[depth]:
            depth += 1
            if depth == len(keys):
                return value.strip()
    return None


def table(path):
    """Rows of a CSV file as dictionaries; lines that begin with # are comments."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@dataclasses.dataclass
class Made:
    """Provenance of a table or figure."""

    command: str
    revisions: list  # of touchfield
    inputs: dict  # {name of a scene or sweep: first 12 digits of its SHA-256}

    def revision(self):
        return " and ".join(self.revisions)

    def scenes(self):
        if len(self.inputs) <= 5:
            return ", ".join(f"{name} {text_hash}" for name, text_hash in self.inputs.items())
        together = hashlib.sha256("\n".join(self.inputs.values()).encode()).hexdigest()[:12]
        return f"{len(self.inputs)} files, together {together}"

    def head(self):
        return f"# made by: {self.command}; revision: {self.revision()}; scenes: {self.scenes() or 'none'}\n"


def steps_of(work, *parts):
    """Stamps of the steps of scripts/reproduce with a name in `parts` or in a folder of that name."""
    kept = [(stamp.stem, json.loads(stamp.read_text())) for stamp in sorted((pathlib.Path(work) / "steps").glob("*.json"))]
    return [stamp for name, stamp in kept if any(name == part.replace("/", "-") or name.startswith(part + "-") for part in parts)]


def made(work, *parts):
    """Provenance of the results of these steps."""
    stamps = steps_of(work, *parts)
    inputs = {pathlib.Path(path).name: text_hash[:12] for stamp in stamps for path, text_hash in stamp["inputs"].items()}
    quick = " --quick" * any(stamp.get("quick", False) for stamp in stamps)
    return Made("scripts/reproduce" + quick, sorted({revision_of(stamp["version"]) for stamp in stamps}), dict(sorted(inputs.items())))


def revision_of(said):
    """The revision in the output of `touchfield --version`."""
    found = re.search(r"\(([^)]+)\)", said)
    return found[1] if found else said.strip() or "unknown"


def write_table(path, rows, origin):
    """Writes dictionaries with equal keys as CSV. The first line is a comment with the provenance."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        file.write(origin.head())
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def percent(value):
    return f"{100 * float(value):.1f} %"
