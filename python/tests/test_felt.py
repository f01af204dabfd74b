"""What the skin does under a result, against the program."""

import csv
import pickle

import h5py
import numpy as np
import pytest

import touchfield as tf

PATTERN = {"pattern": {"circle": {"at": "bottom", "radius_mm": 3, "hz": 100}, "frames_per_second": 1000}, "solve.methods": ["focus"],
           "solve.optimality_bound": False, "evaluation": "same", "write": ["h5"], "field": []}
PLACES = {"points": [[-3e-3, 0, 0.06], [3e-3, 0, 0.06]]}


@pytest.fixture(scope="module")
def results(touchfield, finger, run, tmp_path_factory):
    """A run and a pattern, and their files."""
    folder = tmp_path_factory.mktemp("felt")
    run.save(folder / "run.h5")
    scene = tf.Model(finger, set=PATTERN).scene
    (folder / "pattern.yaml").write_text(scene)
    touchfield("pattern", folder / "pattern.yaml", "-o", folder / "pattern", "--threads", "2", "--quiet")
    return {"run": (run, folder / "run.h5"), "pattern": (tf.read_motion(folder / "pattern/pattern.h5"), folder / "pattern/pattern.h5")}


@pytest.mark.parametrize("kind, keys, spelled", [
    ("run", {**PLACES, "reference": "focus"}, ["felt.points_mm=[[-3,0,60],[3,0,60]]", "felt.reference=focus"]),
    ("run", {"layers": "half_space", "shear": 12.3e3, "tan_delta": 0.3, "modulation_hz": 90, "at": (1e-3, 2e-3, 0.06)},
     ["felt.layers=half_space", "felt.shear_kpa=12.3", "felt.tan_delta=0.3", "felt.modulation_hz=90", "felt.at_mm=[1,2,60]"]),
    ("pattern", {"bone": 5e-3, "frames_per_second": 1500, "highest_hz": 400}, ["felt.bone_mm=5", "felt.frames_per_second=1500", "felt.highest_hz=400"]),
])
def test_numbers_are_those_of_the_program(touchfield, results, tmp_path, kind, keys, spelled):
    result, path = results[kind]
    touchfield("felt", path, "-o", tmp_path / "felt", *(word for change in spelled for word in ("--set", change)))
    felt = result.felt(**keys)
    with open(tmp_path / "felt/felt.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for mine, row in zip(felt.table(), rows, strict=True):
        assert mine.keys() == row.keys() and (mine["method"], mine["skin"]) == (row["method"], row["skin"])
        assert np.array_equal([*mine.values()][2:], [float(value) for value in [*row.values()][2:]], equal_nan=True)
    felt.save(tmp_path / "mine.h5")
    with h5py.File(tmp_path / "felt/felt.h5") as file, h5py.File(tmp_path / "mine.h5") as saved:
        assert all(np.array_equal(file["patch"][name], getattr(felt.patch, name)) for name in ("middle", "axes", "faces", "places", "areas"))
        assert np.array_equal(file["points/at"], [point.at for point in felt.points])
        for method in felt.methods:
            for skin in felt.skins:
                kept, maps = file["methods"][method]["skins"][skin], felt[method, skin]
                assert np.array_equal(kept["spectrum"], maps.spectrum) and maps.spectrum.shape == (len(felt.points), len(maps.hz))
                assert np.array_equal(kept["displacement"], saved["methods"][method]["skins"][skin]["displacement"], equal_nan=True)
                maps = {"displacement": maps.displacement, "velocity": maps.velocity, **{f"energy_{name}": part for name, part in maps.energy.items()},
                        **{f"weighted_{name}": part for name, part in maps.weighted.items()}}
                assert maps.keys() | {"spectrum"} == set(kept)
                assert all(np.allclose(kept[name], part, rtol=1e-6, equal_nan=True) for name, part in maps.items())
    assert "stiff" in repr(felt) and pickle.loads(pickle.dumps(felt)).table()[0] == pytest.approx(felt.table()[0], nan_ok=True)
