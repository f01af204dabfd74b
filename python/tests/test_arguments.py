"""What is refused, and that the message names argument, value and rule."""

import numpy as np
import pytest

import touchfield as tf

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 1e-2
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


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
    (VERTICES[:, :2], TRIANGLES, tf.InputError, r"Mesh: vertices must have shape \(n, 3\), not \(4, 2\)"),
    (VERTICES[0], TRIANGLES, tf.InputError, r"Mesh: vertices must have shape \(n, 3\), not \(3,\)"),
    (VERTICES * [1, 1, np.nan], TRIANGLES, tf.InputError, r"Mesh: vertices\[0, 2\] = nan must be finite"),
    (VERTICES.astype(str), TRIANGLES, TypeError, "Mesh: vertices must hold real numbers, not <U"),
    (VERTICES + 0j, TRIANGLES, TypeError, "Mesh: vertices must hold real numbers, not complex128"),
    ([[0, 0, 0], [1, 0]], TRIANGLES, tf.InputError, "Mesh: vertices is not an array"),
    (VERTICES, TRIANGLES * 1.0, TypeError, "Mesh: triangles must hold whole numbers, not float64"),
    (VERTICES, TRIANGLES - 1, tf.InputError, "Mesh: triangles must hold numbers of vertices, not -1"),
    (VERTICES, TRIANGLES + 1, tf.InputError, "face 1 names a vertex outside 0..3"),
    (VERTICES, TRIANGLES > 0, TypeError, "Mesh: triangles must hold whole numbers, not bool"),
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
    with pytest.raises(tf.InputError, match="target.pressure_pa"):
        tf.run(finger, set={"target.pressure_pa": -1})
    with pytest.raises(TypeError, match="set values must be numbers, strings, lists or dicts, not a set"):
        tf.run(finger, set={"solve.methods": {1, 2}})
    with pytest.raises(tf.InputError, match="threads = 0 must be 1 to 4096"):
        tf.run(finger, threads=0)
    with pytest.raises(tf.InputError, match="solve.device"):
        tf.run(finger, device="abacus")
    with pytest.raises(tf.InputError, match="pose"):
        tf.hand("wave")
    with pytest.raises(tf.InputError, match="side = 'both' must be right or left"):
        tf.hand(side="both")
    with pytest.raises(TypeError, match="set must be a dict, not list"):
        tf.run(finger, set=["solve.iterations=3"])
    with pytest.raises(TypeError, match="set: a key must be a str, not int"):
        tf.run(finger, set={3: 4})
    with pytest.raises(UnicodeEncodeError):
        tf.run(finger, set={"\ud800": 4})
    with pytest.raises(tf.InputError, match=r"path 'a\\x00b' must hold no null character"):
        tf.run("a\0b")
    with pytest.raises(tf.InputError, match="no such file") as caught:
        tf.run(b"\xff.yaml")  # as a file may be called
    assert "\udcff.yaml" in str(caught.value)
    with pytest.raises(TypeError, match="own must be a dict, not int"):
        tf.run(finger, own=3)
    with pytest.raises(TypeError):
        tf.run(3)


def test_own_methods(model):
    channels = len(model.array)
    for many in (np.zeros(channels + 1), tf.Array.grid(5, 13).focus([0, 0, 0.1])):
        with pytest.raises(tf.InputError, match=r"run: own\['mine'\] has 65 values and must have 64, one per channel"):
            tf.run(model, own={"mine": many})
    with pytest.raises(tf.InputError, match=r"run: own\['mine'\]\[3\] = inf must be finite"):
        tf.run(model, own={"mine": np.where(np.arange(channels) == 3, np.inf, 0)})
    with pytest.raises(TypeError, match="own: a name must be a str, not int"):
        tf.run(model, own={1: np.zeros(channels)})
    with pytest.raises(tf.InputError, match="paper"):
        tf.run(model, own={"paper": np.zeros(channels)})
    with pytest.raises(tf.InputError, match="my method"):
        tf.run(model, own={"my method": np.zeros(channels)})
    with pytest.raises(tf.InputError, match="set and device need a scene file"):
        tf.run(model, set={"solve.iterations": 3})
    with pytest.raises(tf.InputError, match=r"run: own\['loud'\]\[0\]: the amplitude 1.00001 must be 0 to 1"):
        tf.run(model, own={"loud": np.full(channels, 1.00001j)})
    with pytest.raises(tf.InputError, match=r"evaluate: drives\[0\]: the amplitude 2 must be 0 to 1"):
        tf.evaluate(model, np.full(channels, 2j))
    with pytest.raises(tf.InputError, match="send: drives: the amplitude 2 must be 0 to 1"):
        tf.send(model.array, np.full(channels, 2j))
    with pytest.raises(tf.InputError, match="evaluate: drives has 3 values and must have 64, one per channel"):
        tf.evaluate(model, [0, 1, 2])


@pytest.mark.parametrize("call, error, says", [
    (lambda ball: tf.hand(edge=3), tf.InputError, "^hand: edge = 3 must be 0.0003 to 0.012 for a hand, in m$"),
    (lambda ball: tf.hand(edge={"far": 8, "near": {"index_pad": 2e-3}}), tf.InputError, "^hand: edge.far = 8 must be 0.0003 to 0.012 for a hand, in m$"),
    (lambda ball: tf.hand(forearm=25), tf.InputError, "^hand: forearm = 25 must be 0 to 0.3, in m$"),
    (lambda ball: tf.hand(joints={"index": {"pip": 3}}), tf.InputError, "^hand: joints.index.pip: unknown key, did you mean pip_deg"),
    (lambda ball: tf.hand(edge="thick"), TypeError, "^edge must be a number, not str$"),
    (lambda ball: tf.Array.grid(0, 4), tf.InputError, "^Array.grid: nx = 0 must be 1 to 1000$"),
    (lambda ball: tf.Array.grid(1000, 1000), tf.InputError, "^Array.grid: array: 1000000 transducers, must be at most 100000$"),
    (lambda ball: tf.Array.grid(4, 4, level=80), tf.InputError, "^Array.grid: level = 80 must be > 0 and <= 1; if 80 is in percent"),
    (lambda ball: tf.Target.points(ball, [[0, 0, -5e-3]], [3e-3], 800), TypeError, "^Target.points: diameter must be a number, not list$"),
    (lambda ball: tf.Target.line(ball, [[0, 0, -5e-3]] * 2, None, 800), TypeError, "^Target.line: width must be a number, not NoneType$"),
    (lambda ball: tf.Target.points(ball, [[0, 0, -5]], 3e-3, 800), tf.InputError, "^Target.points: points.0.: .* off the skin.*thousandth"),
    (lambda ball: tf.check({"array": {"grid": {"count": [0, 4]}}, "body": ball, "solve": {"methods": ["focus"]}}), tf.InputError,
     "^array.grid.count.0. = 0 must be"),
])
def test_errors_name_the_argument_and_its_unit(ball, call, error, says):
    with pytest.raises(error, match=says):
        call(ball)


def test_arrays_and_transfers(ball, pair):
    with pytest.raises(tf.InputError, match="Array: normals has 1 values and must have 2, one per position"):
        tf.Array([[0, 0, 0], [1, 0, 0]], [[0, 0, 1]])
    with pytest.raises(tf.InputError, match="axis of transducer 0 has length 2, it must be 1"):
        tf.Array([[0, 0, 0]], [[0, 0, 2]])
    with pytest.raises(tf.InputError, match="directivity = 'loud' must be omni, piston or t4010a1"):
        tf.Array([[0, 0, 0]], [[0, 0, 1]], directivity="loud")
    with pytest.raises(tf.InputError, match=rf"transfer: faces\[1\] = {len(ball)} must be 0 to {len(ball) - 1}"):
        tf.transfer(ball, pair, faces=[0, len(ball)])
    with pytest.raises(TypeError, match="transfer: faces must hold whole numbers, not float64"):
        tf.transfer(ball, pair, faces=[0.5])
    with pytest.raises(tf.InputError, match="scheme = 'magic' must be one of paper, "):
        tf.transfer(ball, pair, scheme="magic")
    with pytest.raises(tf.InputError, match="device = 'abacus' must be auto, cpu, cuda"):
        tf.transfer(ball, pair, device="abacus")


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


def test_problems(ball, pair):
    h = tf.transfer(ball, pair, faces=[0, 1, 2])
    problem = tf.Problem(h, [1, 1, 1], [1, 1, 1])
    assert problem.outside.shape == (0, 2) and np.array_equal(problem.target, h)
    for amplitudes, weights in (([1, 1], [1, 1, 1]), ([1, 1, 1], [1, 1]), ([1, 1, -1], [1, 1, 1]), ([1, 1, 1], [1, 0, 1])):
        with pytest.raises(tf.InputError, match="Problem"):
            tf.Problem(h, amplitudes, weights)
    with pytest.raises(tf.InputError, match=r"Problem: target\[0, 1\] = nan.* must be finite"):
        tf.Problem(np.where(np.arange(2) == 1, np.nan, h), [1, 1, 1], [1, 1, 1])
    with pytest.raises(tf.InputError, match="surface: start has 3 values and must have 2, one per channel"):
        tf.surface(problem, start=[1, 1, 1])
    with pytest.raises(tf.InputError, match="lbfgs: start = 'best' must be adjoint, spectral, zero or a drive vector"):
        tf.lbfgs(problem, start="best")
    with pytest.raises(tf.InputError, match="surface: iterations = 0 must be >= 1"):
        tf.surface(problem, iterations=0)
    with pytest.raises(tf.InputError, match="field: pressure has 3 values"):
        tf.field(ball, pair, [1, 2, 3], [1, 1], [[0, 0, 0]])
    with pytest.raises(tf.InputError, match=r"field: points must have shape \(n, 3\), not \(3,\)"):
        tf.field(ball, pair, np.zeros(len(ball)), [1, 1], [0, 0, 0])
    with pytest.raises(ValueError, match="read-only"):
        problem.target[0] = 0
    h[0] = 0  # one's own


def test_errors_are_what_python_has_for_them():
    assert issubclass(tf.InputError, ValueError) and issubclass(tf.NumericalError, ArithmeticError)
    assert issubclass(tf.IoError, OSError) and issubclass(tf.DeviceError, RuntimeError)
    for error in (tf.InputError, tf.NumericalError, tf.IoError, tf.DeviceError, tf.NotBuiltError):
        assert issubclass(error, tf.Error) and error.__module__ == "touchfield"


def test_what_cannot_be_written(ball, run, tmp_path):
    with pytest.raises(tf.InputError, match="a.pdf: the name of a picture must end in .png; figures for print come from run.figure"):
        run.picture().save(tmp_path / "a.pdf")
    with pytest.raises(tf.IoError, match="/dev/full|/dev"):
        ball.save("/dev/null/ball.stl")
    with pytest.raises(tf.InputError, match="ball.txt"):
        ball.save("ball.txt")
