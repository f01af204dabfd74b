"""Patterns and what leaves for other code, against the program."""

import csv
import pickle
import types

import h5py
import numpy as np
import pytest

import touchfield as tf

PATTERN = {"pattern": {**tf.circle("bottom", 3e-3, 100), "frames_per_second": 1000, "watch": ["bottom"]}, "solve.optimality_bound": False,
           "evaluation": "same", "write": ["h5"], "field": []}


@pytest.fixture(scope="module")
def pattern(finger):
    return tf.pattern(finger, set=PATTERN, check=5, threads=2)


@pytest.fixture(scope="module")
def folder(touchfield, pattern, tmp_path_factory):
    """What the program makes of it."""
    folder = tmp_path_factory.mktemp("pattern")
    (folder / "pattern.yaml").write_text(pattern.scene)
    touchfield("pattern", folder / "pattern.yaml", "-o", folder / "out", "--check", "5", "--threads", "2", "--quiet")
    return folder / "out"


def test_numbers_are_those_of_the_program(pattern, folder, tmp_path):
    pattern.save(tmp_path / "mine.h5")
    read = tf.read_motion(folder / "pattern.h5")
    with h5py.File(folder / "pattern.h5") as file, h5py.File(tmp_path / "mine.h5") as saved:
        for kept in (pattern, read, pickle.loads(pickle.dumps(pattern))):
            frames = file["methods/surface/frames"]
            assert isinstance(kept, tf.Pattern) and kept.methods == ["surface"] and kept.complete
            assert all(np.array_equal(mine, frames[name]) for mine, name in zip(kept.frames(), ("phases", "amplitudes")))
            assert np.array_equal(kept.radiation, file["patch/radiation"]) and kept.frames_per_second == file["patch"].attrs["frames_per_second"]
            assert np.array_equal(kept.patch.faces, file["patch/faces"]) and len(kept.patch.places) == kept.radiation.shape[1]
            assert np.array_equal([*kept.points.values()], file["patch/points"]) and kept.duration == 0.01
            assert np.array_equal(kept.scores["surface"]["relative_error"], file["methods/surface/scores/relative_error"])
        assert np.array_equal(saved["patch/radiation"], file["patch/radiation"])
    with open(folder / "spectrum.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [*pattern.points] == [*dict.fromkeys(row["point"] for row in rows)] and "bottom" in pattern.points
    for point in pattern.points:
        lines = [(float(row["hz"]), float(row["radiation_rms_pa"])) for row in rows if row["point"] == point]
        assert np.array_equal(np.transpose(pattern.spectrum(point)), lines) and pattern.spectrum(point, highest=150)[0].tolist() == [100]


def test_it_is_sent_at_its_own_rate(touchfield, pattern, folder, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "program").mkdir()
    report = tf.send(pattern, to=f"dry-run:{tmp_path / 'mine/frame.txt'}")
    touchfield("send", folder, "--to", f"dry-run:{tmp_path / 'program/frame.txt'}")
    assert (report["frames"], report["rate_hz"], report["emitted"]) == (10, 1000, False)
    mine, program = ({path.name: path.read_text() for path in (tmp_path / by).iterdir()} for by in ("mine", "program"))
    assert len(mine) == 10 and mine == program
    with pytest.raises(TypeError, match="drives need an Array"):
        tf.send(pattern, np.exp(1j * pattern.frames()[0]))
    assert tf.send(pattern.array, np.exp(1j * pattern.frames()[0]))["frames"] == 10


def test_frames_have_the_order_of_the_device(run):
    for name in run.methods:
        phases, amplitudes = run.frames(name)
        assert np.array_equal(phases, run.phases[name][None]) and np.array_equal(amplitudes, run.amplitudes[name][None])
    array = tf.Array.autd3(2, 1)
    assert array.device.tolist() == [0] * 249 + [1] * 249 and array.channel.tolist() == [*range(249)] * 2
    turned = types.SimpleNamespace(methods=["mine"], phases={"mine": np.arange(4.0)}, amplitudes={"mine": np.arange(4) / 4},
                                   array=types.SimpleNamespace(device=[1, 0, 1, 0], channel=[1, 1, 0, 0]))
    assert [part.tolist() for part in tf.Run.frames(turned)] == [[[3, 1, 2, 0]], [[0.75, 0.25, 0.5, 0]]]


def test_a_larger_phase_is_later():
    array = tf.Array([[0, 0, 0], [0.01, 0, 0]])
    along = array.transfer([[0.3, 0, 0.1]])[0]
    near = tf.Wave().wavelength / 8
    later = np.angle(array.transfer([[0.3 + near, 0, 0.1]])[0] / along)
    assert np.all(later > 0)  # p ~ exp(i k r): so does a phase that is larger
