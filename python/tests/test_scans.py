"""How scans were taken, and the responses of channels, from fields that are known."""

import sys

import numpy as np
import pytest

import touchfield as tf
from conftest import SOURCE
from touchfield import _scans

sys.path.insert(0, str(SOURCE / "scripts/makers"))
import package as fields  # noqa: E402

pytest.importorskip("scipy")
SETTING = {"x": 2e-3, "y": -1e-3, "z": 1.5e-3, "turn_x": 0.02, "turn_y": -0.01, "turn_z": 0.05, "size": 1.04, "receiver": 3e-3,
           "sound_speed": 1.01}


def noisy(values, share, seed):
    noise = np.random.default_rng(seed).standard_normal((2, len(values)))
    return values + share * np.sqrt(np.mean(abs(values) ** 2) / 2) * (noise[0] + 1j * noise[1])


@pytest.fixture(scope="module")
def run():
    scene = SOURCE / "scenes/capsule.yaml"
    return tf.run(str(scene), set={"solve.methods": ["focus"], "array.grid.count": [8, 8], "target.box.offset_mm": [2, 1, 0]})


@pytest.fixture(scope="module")
def far():
    """Its body is far: near one, magnitudes repeat every half wavelength towards it."""
    return tf.run(str(SOURCE / "scenes/capsule.yaml"), set={"solve.methods": ["focus"], "array.grid.count": [8, 8],
                                                       "body.place.at_mm": [0, 0, 400], "target.box.offset_mm": [2, 1, 0]})


@pytest.fixture(scope="module")
def plane():
    return np.array([[x, y, 0.035] for y in 3e-3 * (np.arange(20) - 9.5) for x in 3e-3 * (np.arange(20) - 9.5)])


def taken(run, plane, setting):
    return 0.3 * _scans._reading(run, "focus", _scans._placed(plane, plane.mean(axis=0), setting), setting)


@pytest.mark.parametrize("magnitudes", [False, True])
def test_a_fit_finds_how_a_scan_was_taken(run, far, plane, magnitudes):
    fit, start = ["place", "turn", "size", "receiver"], {"sound_speed": SETTING["sound_speed"]}
    if magnitudes:
        run, values = far, abs(taken(far, plane, SETTING))
    else:
        values, fit, start = taken(run, plane, SETTING), [*fit, "sound_speed"], None
    found = tf.fit_scan(run, plane, values, fit, start=start)
    assert tf.compare_scan(run, plane, values).relative > 0.2 and found.relative < 0.01
    for name, within in zip(SETTING, [5e-5] * 3 + [2e-3] * 3 + [1e-3, 1e-4, 1e-3]):
        assert found.setting[name] == pytest.approx(SETTING[name], abs=within), name


def test_points_on_the_skin_and_in_the_body_do_not_count(run, plane):
    points = np.concatenate([plane, [[0, 0, 0.068], [0, 0, 0.0595], run.array.positions[9]]])
    found = tf.compare_scan(run, points, np.append(taken(run, plane, {**SETTING, "receiver": 0}), [1, 1, 1]))
    assert found.used.tolist() == [True] * len(plane) + [False] * 3


def test_scans_are_read_as_they_were_written(run, plane, tmp_path):
    for values in (taken(run, plane, SETTING), abs(taken(run, plane, SETTING))):
        tf.compare_scan(run, plane, values).save(tmp_path / "scan.csv")
        points, pressure = tf.read_scan(tmp_path / "scan.csv")
        assert points == pytest.approx(plane, abs=1e-12) and pressure == pytest.approx(values, rel=1e-9)
    with pytest.raises(tf.IoError, match="read_scan: .*missing.csv"):
        tf.read_scan(tmp_path / "missing.csv")


@pytest.fixture(scope="module")
def twin():
    """A run of an array as designed, its body far away, and the true responses of its channels, of which two are dead."""
    run = tf.run(str(SOURCE / "scenes/capsule.yaml"), set={"solve.methods": ["focus"], "array.grid.count": [8, 8],
                                                       "body.place.at_mm": [0, 0, 500]})
    random = np.random.default_rng(3)
    truth = (1 + 0.1 * random.standard_normal(64)) * np.exp(0.25j * random.standard_normal(64))
    truth[[10, 37]] = 0
    return run, truth


def scanned(twin, side=24, spacing=5e-3):
    run, truth = twin
    points = np.array([[x, y, 0.02] for y in spacing * (np.arange(side) - side / 2 + 0.5) for x in spacing * (np.arange(side) - side / 2 + 0.5)])
    wrong = run.array.transfer(points) @ ((truth - 1) * run.drives["focus"])
    return tf.compare_scan(run, points, noisy(0.02 * np.exp(1j) * (run.field(points)["focus"] + wrong), 0.02, 11))


def test_a_calibration_finds_gain_phase_and_dead_channels(twin, tmp_path):
    found = tf.fit_calibration(scanned(twin))
    assert found.dead == 2 and found.gain[10] == found.gain[37] == 0 and found.noise == pytest.approx(0.02, abs=0.005)
    mine, truth = found.gain * np.exp(1j * found.phase), twin[1]
    off = abs(np.vdot(mine, truth) / np.vdot(mine, mine) * mine - truth)  # a common factor cannot be known
    assert np.sqrt(np.mean(off**2)) < 0.03 < 0.2 < np.sqrt(np.mean(abs(truth - 1) ** 2))
    found.save(tmp_path / "found.csv")
    calibration = {"file": str(tmp_path / "found.csv"), "in": "both"}
    array = tf.Model(str(SOURCE / "scenes/capsule.yaml"), {"array.grid.count": [8, 8], "array.calibration": calibration}).array
    ratio = array.transfer([[0, 0, 0.03]]) / twin[0].array.transfer([[0, 0, 0.03]])
    assert ratio[0] == pytest.approx(mine, abs=1e-12)


@pytest.mark.skipif(not fields.data_folder().is_dir(), reason="TOUCHFIELD_DATA names the parent of measured_256")
def test_the_maps_of_others_fit_as_in_the_table(tmp_path):
    """Correlations within 0.005 of results/tables/measured_fields.csv, and the radius of the microphone within 0.1 mm."""
    lines = (SOURCE / "results/tables/measured_fields.csv").read_text().splitlines()[2:]
    kept = {(line.split(",")[0], "receiver" in line): line.rsplit('"', 1)[1].split(",")[1:] for line in lines}
    for row in fields.measured(fields.data_folder(), tmp_path, ["HeightMod_Star"]):
        _, correlation, _, radius, *_ = kept[row["map"], "receiver" in row["fitted"]]
        assert row["correlation"] == pytest.approx(float(correlation), abs=0.005) and row["receiver_mm"] == pytest.approx(float(radius), abs=0.1), row
