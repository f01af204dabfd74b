"""The trials of the width discrimination: the pressure on the evaluation mesh for every hand, width and method."""

import dataclasses
import json
import pathlib

import h5py
import numpy as np

from runs import table

WIDTHS = np.array([5.0, 8.0, 11.0])  # mm
REACH_MM, CELL_MM = 12, 1.5


@dataclasses.dataclass
class Trials:
    """One row per trial and method. `pattern` is abs(p)^2 over the wanted pressure squared [1]."""
    hand: np.ndarray  # [N] name of the folder
    width_mm: np.ndarray  # [N] wanted: 5, 8 or 11
    method: np.ndarray  # [N] of widths.METHODS
    reading: np.ndarray  # [N] width at half maximum of abs(p)^2 [mm]; NaN if it does not exist
    reading_radiation: np.ndarray  # [N] the same of the radiation pressure P
    noise: np.ndarray  # [N] of the sensed surface [mm RMS]
    pattern: np.ndarray  # [N, cells] averages over cells of 1.5 mm


def cell_averages(triangles: np.ndarray, area: np.ndarray, value: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Area averages of one value per face over the cells between the edges x and y [mm]. NaN where there is no skin.

    `triangles` [M, 3, 3] in mm. A face is cut into 16 parts, so that each cell that it touches gets its share.
    """
    n = 4
    corner = [(i + 1 / 3, j + 1 / 3) for i in range(n) for j in range(n - i)]
    corner += [(i + 2 / 3, j + 2 / 3) for i in range(n - 1) for j in range(n - 1 - i)]
    u, v = np.array(corner).T / n
    points = np.einsum("ck,mkd->mcd", np.stack([1 - u - v, u, v], axis=1), triangles)[..., :2].reshape(-1, 2)
    weight = np.repeat(area, n * n)
    total = np.histogram2d(*points.T, bins=[x, y], weights=weight)[0]
    with np.errstate(invalid="ignore"):
        return np.histogram2d(*points.T, bins=[x, y], weights=weight * np.repeat(value, n * n))[0] / total


def load(hands_folder: str | pathlib.Path) -> Trials:
    """Reads every hand_* of the folder.

    The patterns keep only the cells that have skin on every hand. Filling the others with their neighbours' values would show
    the same skin twice, with new internal noise.
    """
    edges = np.arange(-REACH_MM, REACH_MM + CELL_MM / 2, CELL_MM)
    rows, patterns = [], []
    for folder in sorted(pathlib.Path(hands_folder).glob("hand_*")):
        cases: dict[int, list[dict]] = {}
        for row in table(folder / "sweep.csv"):
            if row["status"] == "ok":
                cases.setdefault(int(row["case"]), []).append(row)
        for case, lines in cases.items():
            with h5py.File(folder / "cases" / f"{case:05d}" / "run.h5") as run:
                evaluation = run["evaluation"]
                corners = 1e3 * evaluation["mesh/vertices"][:][evaluation["mesh/triangles"][:]]
                normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                seen = normal[:, 2] < -0.3 * np.linalg.norm(normal, axis=1)
                corners, area = corners[seen], evaluation["mesh/area"][:][seen]
                wanted = evaluation["target/amplitude"][:].max()
                for row in lines:
                    energy = np.abs(evaluation["methods"][row["name"]]["pressure"][:][seen] / wanted) ** 2
                    patterns.append(cell_averages(corners, area, energy, edges, edges).ravel())
                    rows.append((folder.name, json.loads(row["target.box.size_mm"])[0], row["name"],
                                 float(row["width_mm"] or "nan"), float(row["width_radiation_mm"] or "nan"),
                                 float(row["sensing.noise_mm_rms"])))
    if not rows:
        raise ValueError(f"{hands_folder}: no case with status ok in any hand_*/sweep.csv")
    hand, width, method, reading, reading_radiation, noise = map(np.array, zip(*rows))
    pattern = np.array(patterns)
    skin = np.isfinite(pattern).all(axis=0)
    return Trials(hand, width.astype(float), method, reading, reading_radiation, noise, pattern[:, skin])


def evened(trials: Trials) -> Trials:
    """The trials with every pattern scaled to the same mean.

    Loudness alone then tells nothing, and an observer's noise affects every method equally.
    """
    level = trials.pattern[trials.method == "paper"].mean()
    return dataclasses.replace(trials, pattern=trials.pattern * (level / trials.pattern.mean(axis=1, keepdims=True)))


def classes(trials: Trials) -> np.ndarray:
    """Index of the wanted width in WIDTHS, one per row."""
    return np.abs(trials.width_mm[:, None] - WIDTHS).argmin(axis=1)
