"""Motions, cameras and what is sent, against the program."""

import csv
import sys

import h5py
import numpy as np
import pytest

import touchfield as tf
from conftest import SOURCE

MOTION = {"seconds": 0.3, "change": [{"path": "body.place.at_mm.0", "rate": 40}], "solve_ms": 20}
CAMERAS = {"seconds": 0.1, "sensor": {"cameras": [{"at_mm": [200, 0, -150], "look_at_mm": [0, 0, 65], "resolution": [160, 90]}]}}


@pytest.fixture(scope="module")
def motion(finger):
    return tf.play(finger, set={"motion": MOTION, "solve.methods": ["surface", "focus"], "evaluation": "same", "solve.optimality_bound": False},
                   threads=2)


def test_a_motion_is_that_of_the_program(touchfield, finger, motion, tmp_path):
    (tmp_path / "moving.yaml").write_text(motion.scene)
    touchfield("play", tmp_path / "moving.yaml", "-o", tmp_path / "out", "--threads", "2", "--quiet")
    assert motion.methods == ["surface", "focus"] and motion.duration == 0.3 and motion.complete
    with h5py.File(tmp_path / "out/motion.h5") as file:
        for name in motion.methods:
            kept = file["methods"][name]
            assert np.array_equal(kept["frames/phases"], motion.phases[name])
            assert np.array_equal(kept["scores/time"], motion.scores[name]["time_s"])
            assert np.array_equal(kept["scores/relative_error"], motion.scores[name]["relative_error"], equal_nan=True)
    read = tf.read_motion(tmp_path / "out/motion.h5")
    assert np.array_equal(read.phases["surface"], motion.phases["surface"]) and read.summary["focus"]["frames"] == 6


def test_a_motion_writes_what_the_program_writes(motion, tmp_path):
    tf.play(motion.scene, tmp_path / "out", set={"solve.methods": ["focus"], "write": ["h5"]})
    assert {"motion.h5", "motion.csv", "frames.csv"} <= {path.name for path in (tmp_path / "out").iterdir()}
    with pytest.raises(tf.InputError, match="force"):
        tf.play(motion.scene, tmp_path / "out")
    motion.save(tmp_path / "one.h5")
    with pytest.raises(tf.InputError, match="one.h5: the file exists; force=True replaces it"):
        motion.save(tmp_path / "one.h5")


def test_a_figure_of_a_motion(motion):
    pytest.importorskip("matplotlib")
    axes = motion.figure().axes
    assert [ax.get_ylabel() for ax in axes] == ["relative error [%]", "displacement [mm]", "mean inside [Pa]"]
    error, displacement, _ = (ax.lines[0].get_ydata() for ax in axes)
    assert np.allclose(error, 100 * motion.scores["surface"]["relative_error"], equal_nan=True)
    assert np.allclose(displacement, 1e3 * motion.scores["surface"]["displacement_m"], equal_nan=True)


def test_what_cameras_see_and_what_is_fitted(finger, tmp_path):
    seen = tf.see(finger, tmp_path / "images", set={"motion": CAMERAS})
    assert len(seen) == 1 and seen[0]["pixels"] > 0 and 0.1 < seen[0]["nearest"] <= seen[0]["farthest"] < 0.5
    assert (tmp_path / "images/times.csv").exists()
    with pytest.raises(tf.InputError, match="hand"):  # a finger of a capsule is none
        tf.fit(tmp_path / "images", tmp_path / "hand", learn=0)


def test_dry_runs(run, motion, tmp_path, touchfield):
    report = tf.send(run, method="focus", to=f"dry-run:{tmp_path / 'mine.txt'}")
    assert report["frames"] == 1 and not report["emitted"] and report["files"] == 1
    run.save(tmp_path / "run.h5")
    touchfield("send", tmp_path / "run.h5", "--method", "focus", "--to", f"dry-run:{tmp_path / 'program.txt'}")
    assert (tmp_path / "mine.txt").read_text() == (tmp_path / "program.txt").read_text()
    assert tf.send(motion, method="focus", rate=20)["frames"] == 6
    assert tf.send([run, run], method="surface")["frames"] == 2
    half = tf.send(run.array, 0.5 * run.drives["focus"])
    assert half["drive_loss"] < 0.01 and half["worst_phase_error_rad"] < np.pi / 200
    same = tf.send(run.array, tf.Array.focus(run.array, [0, 0, 0.1]))
    assert same["transducers"] == 64


def test_an_emission_ends_in_silence():
    """A board on a pseudo-terminal hears the phases, then that it is to be silent."""
    sys.path.insert(0, str(SOURCE / "tests/hardware"))
    from sonicsurface_board import Board

    board = Board()
    array = tf.Array.sonicsurface()
    try:
        report = tf.send(array, array.focus([0, 0, 0.1]), to=f"sonicsurface:{board.port}", emit=True, seconds=0.3, max_level=1)
        assert report["emitted"] and report["silent"] and report["sent"] == 1
        assert board.wait(lambda heard: heard.silent_at is not None) and board.firmware.faults == []
        with pytest.raises(tf.InputError, match="level"):
            tf.send(array, array.focus([0, 0, 0.1]), to=f"sonicsurface:{board.port}", emit=True)
    finally:
        board.close()
