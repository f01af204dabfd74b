"""What is refused, and that the message names argument, value and rule."""

import re

import numpy as np
import pytest

import touchfield as tf

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 1e-2
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])

# What is wrong, in the words of the call: arguments by name, lengths in m, no scene that nobody wrote.
CALLS = [
    ("tf.Mesh(ball.vertices)", "Mesh(): missing a required argument: 'triangles'"),
    ('ball.translate("x")', "Mesh.translate: shift must hold real numbers, not str"),
    ("ball.translate([1, 2])", "Mesh.translate: shift has 2 values and must have 3, one per axis"),
    ('tf.sphere("8", 3e-3)', "sphere: radius must be a number, not str"),
    ("tf.sphere(-1, 3e-3)", "sphere: radius = -1 must be > 0"),
    ('tf.hand(edge={"far": 6e-3})', "hand: edge must have far and near"),
    ("tf.gs(5)", "gs: h must be a touchfield.Problem, or H with a target; it is of type int, and target is None"),
    ('tf.hand(edge={"far": 6e-3, "near": {"index_pad": 2e-3}, "growth": -1})', "hand: edge.growth = -1 must be 0.02 to 0.6"),
    ("tf.Array([[0, 0, 0]], piston_radius=4.5)", "Array: piston_radius = 4.5 m must be > 0 and <= 1"),
    ("tf.Array.autd3(units=[([0, 0, 0], [0, 0, 0]), ([0, 0, 0], [0, 0, 0])])", "are at and pitch in m?"),
    ("pair.field([[0, 0, 0.1]], None)", "Array.field: drives must be an array or a touchfield.Solution, not NoneType"),
    ("tf.Target(ball, [1], np.nan)", "Target: amplitudes must be >= 0, and one of them > 0"),
    ('tf.Target.box(ball, "nose", [8e-3, 8e-3, 6e-3], 3)', "Target.box: at: landmark 'nose' is missing"),
    ("tf.Target.box(ball, [0, 0, -8], [8, 8, 6], 3)", "Target.box: the box about"),
    ("tf.surface(np.ones((3, 2)), tf.Target(ball, [0, 1], 5))", "surface: h has 3 values and must have 180, one per face"),
    ('tf.Model("capsule", set={"array.grid.counts": 3})', "set array.grid.counts=3: array.grid.counts: unknown key, did you mean count?"),
    ('tf.Model({"body": object()})', "values of a scene must be numbers, strings, lists or dicts, not object"),
    ('tf.run(model, own={"mine": None})', "run: own['mine'] must hold real numbers, not None"),
    ('tf.circle("bottom", 3, 100)', "circle: radius = 3 must be > 0 and <= 0.2"),
    ('tf.study("quick", edges=[-1])', "study: edges: -1 m must be > 0"),
    ("tf.send(pair, [1, 2, 3])", "send: drives of a frame has 3 values and must have 2, one per channel"),
    ("tf.send(pair, [1, 2], max_level=2)", "max_level = 2 must be > 0 and <= 1"),
]


@pytest.fixture(scope="module")
def ball():
    return tf.sphere(5e-3, 2.5e-3)


@pytest.fixture(scope="module")
def pair():
    return tf.Array([[0, 0, -0.1], [0.01, 0, -0.1]], [[0, 0, 1], [0, 0, 1]])


def test_arrays_of_any_kind_are_taken():
    mesh = tf.Mesh(VERTICES, TRIANGLES)
    backwards = np.ascontiguousarray(VERTICES[:, ::-1])[:, ::-1]
    fixed = VERTICES.copy()
    fixed.flags.writeable = False
    for vertices in (VERTICES.tolist(), np.asfortranarray(VERTICES), backwards, fixed, np.repeat(VERTICES, 2, axis=0)[::2]):
        for triangles in (TRIANGLES.tolist(), TRIANGLES.astype(np.uint8), np.asfortranarray(TRIANGLES)):
            same = tf.Mesh(vertices, triangles)
            assert np.array_equal(same.vertices, mesh.vertices) and np.array_equal(same.triangles, mesh.triangles)
    assert mesh.volume == pytest.approx(1e-6 / 6)


@pytest.mark.parametrize("vertices, triangles, error, words", [
    (VERTICES * [1, 1, np.nan], TRIANGLES, tf.InputError, r"Mesh: vertices\[0, 2\] = nan must be finite"),
    (VERTICES.astype(str), TRIANGLES, TypeError, "Mesh: vertices must hold real numbers, not str"),
    (VERTICES, TRIANGLES * 1.0, TypeError, "Mesh: triangles must hold whole numbers, not float64"),
    (VERTICES, TRIANGLES + 1, tf.InputError, "face 1 names a vertex outside 0..3"),
    (np.zeros((0, 3)), np.zeros((0, 3), int), tf.InputError, "no "),
])
def test_meshes(vertices, triangles, error, words):
    with pytest.raises(error, match=words):
        tf.Mesh(vertices, triangles)


def test_files_and_scenes(tmp_path, finger):
    for call in (tf.read_mesh, tf.run, tf.read_run, tf.check, tf.Model, tf.read_sweep):
        with pytest.raises(tf.InputError, match="missing"):
            call(tmp_path / "missing.stl")
    with pytest.raises(tf.InputError, match="solve.iteration: unknown key, did you mean iterations"):
        tf.check(finger, set={"solve.iteration": 3})
    with pytest.raises(tf.InputError, match="no such file") as caught:
        tf.run(b"\xff.yaml")  # as a file may be called
    assert "\udcff.yaml" in str(caught.value)


@pytest.mark.parametrize("call, error, says", [
    (lambda ball: tf.hand(edge=3), tf.InputError, "^hand: edge = 3 must be 0.0003 to 0.012 for a hand, in m$"),
    (lambda ball: tf.hand(joints={"index": {"pip": 3}}), tf.InputError, "^hand: joints.index.pip: unknown key, did you mean pip_deg"),
    (lambda ball: tf.Array.grid(4, 4, level=80), tf.InputError, "^Array.grid: level = 80 must be > 0 and <= 1; if 80 is in percent"),
    (lambda ball: tf.Target.points(ball, [[0, 0, -5]], 3e-3, 800), tf.InputError, "^Target.points: points.0.: .* off the skin.*thousandth"),
])
def test_errors_name_the_argument_and_its_unit(ball, call, error, says):
    with pytest.raises(error, match=says):
        call(ball)


def test_what_scatters_is_closed_and_looks_outwards(ball, pair):
    for triangles, words in ((ball.triangles[1:], "boundary edges"), (ball.triangles[:, ::-1], "in")):
        mesh = tf.Mesh(ball.vertices, triangles)
        for faces in (None, [0]):
            with pytest.raises(tf.InputError, match=f"transfer: mesh.*{words}"):
                tf.transfer(mesh, pair, faces=faces)
        with pytest.raises(tf.InputError, match=f"field: mesh.*{words}"):
            tf.field(mesh, pair, np.zeros(len(mesh)), [1, 1], [[0, 0, 0.1]])
    at = [[0, 0, 0], [0, 0, -0.1], [0, 0, 0.1]]
    values = tf.field(ball, pair, np.zeros(len(ball)), [1, 1], at)
    assert values[0] == 0 and np.isnan(values[1]) and np.isfinite(values[2])


@pytest.mark.parametrize("call, says", CALLS, ids=[call for call, _ in CALLS])
def test_errors_are_in_the_words_of_the_call(ball, pair, model, run, tmp_path, monkeypatch, call, says):
    monkeypatch.chdir(tmp_path)
    problem = tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1])
    with pytest.raises((TypeError, tf.InputError)) as caught:
        eval(call, {"tf": tf, "np": np, "ball": ball, "pair": pair, "model": model, "run": run, "problem": problem})
    assert says in str(caught.value) and not re.search(r"incompatible function|_mm|--|\.yaml", str(caught.value))
