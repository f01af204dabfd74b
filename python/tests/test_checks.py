"""The program's own checks, where a scene does not make them: units, sizes, clearance, frequency; and what warnings.warn hears."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

import touchfield as tf


@pytest.fixture(scope="module")
def ball():
    return tf.sphere(8e-3, 4e-3)


def test_a_file_in_metres_is_not_read_as_one_in_millimetres(tmp_path):
    hand = tf.hand(edge=8e-3)
    hand.save(tmp_path / "hand.obj", 1.0)
    with pytest.raises(tf.InputError, match="hand.obj: the unit is missing, and the"):
        tf.read_mesh(tmp_path / "hand.obj")
    read = tf.read_mesh(tmp_path / "hand.obj", 1.0)
    assert np.ptp(read.vertices[:, 1]) == pytest.approx(np.ptp(hand.vertices[:, 1]), rel=1e-4)
    with pytest.raises(tf.InputError, match="hand.obj: unit mm makes the body 0.438 mm across; it looks like m"):
        tf.read_mesh(tmp_path / "hand.obj", 1e-3)
    tiny = tf.sphere(2e-3, 1e-3)
    tiny.save(tmp_path / "tiny.obj", 1e-3)
    with pytest.warns(tf.TouchfieldWarning, match="mesh_unit: .*tiny.obj: unit mm makes the body 4.* mm across"):
        tf.read_mesh(tmp_path / "tiny.obj", 1e-3)
    hand.save(tmp_path / "hand.stl", 1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(tf.read_mesh(tmp_path / "hand.stl")) == len(hand)


def test_sizes_of_no_body_are_refused(ball):
    for scale in (1e3, 1e-4):
        with pytest.raises(tf.InputError, match="Mesh: vertices in m: (unit m makes the body|the body is) .* across"):
            tf.Mesh(ball.vertices * scale, ball.triangles)
    with pytest.warns(tf.TouchfieldWarning, match="mesh_unit: Mesh: vertices in m: unit m makes the body 1.6. m across"):
        tf.Mesh(ball.vertices * 1e2, ball.triangles)


def test_warnings_and_notes_are_those_of_the_run(finger):
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        run = tf.run(finger, set={"body.edge_mm": 4, "evaluation": "same"})
    assert run.warnings and run.notes
    ours = [each for each in heard if issubclass(each.category, tf.TouchfieldWarning)]
    assert {str(each.message) for each in ours if each.category is tf.TouchfieldWarning} >= set(run.warnings)
    assert {str(each.message) for each in ours if each.category is tf.TouchfieldNote} >= set(run.notes)
    assert {each.filename for each in ours} == {__file__}
    with warnings.catch_warnings():
        warnings.simplefilter("error", tf.TouchfieldWarning)
        with pytest.raises(tf.TouchfieldWarning, match=run.warnings[0].split(":")[0]):
            tf.Model(finger, set={"body.edge_mm": 4})


def test_a_child_forked_while_another_thread_computes_does_not_hang(finger):
    """Locks of the computing thread stay locked in the child: it says so and computes nothing."""
    code = """if True:
        import os, sys, threading, time
        import touchfield as tf
        model = tf.Model(sys.argv[1], set={"body.edge_mm": 1.5})
        started = threading.Event()
        def compute():
            started.set()
            for _ in range(100):
                tf.run(model)
        threading.Thread(target=compute, daemon=True).start()
        started.wait()
        time.sleep(0.3)
        child = os.fork()
        if child == 0:
            try:
                tf.sphere(0.01, 0.005), tf.run(sys.argv[1])
            except RuntimeError as error:
                os._exit(7 if "forked while another thread computed" in str(error) and "spawn" in str(error) else 8)
            os._exit(9)
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        os._exit(ended)
        """
    for _ in range(3):
        assert subprocess.run([sys.executable, "-W", "ignore", "-c", code, str(finger)], timeout=60).returncode == 7
