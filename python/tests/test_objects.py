"""Objects that compose: bodies, arrays and targets by themselves and within scenes, against the program."""

import pickle

import h5py
import numpy as np
import pytest

import touchfield as tf


@pytest.fixture(scope="module")
def ball():
    return tf.sphere(8e-3, 3e-3)


@pytest.fixture(scope="module")
def array():
    return tf.Array.grid(6, 6, at=[0, 0, -0.1])


@pytest.fixture(scope="module")
def target(ball):
    return tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 200)


@pytest.fixture(scope="module")
def h(ball, array):
    return tf.transfer(ball, array)


def marked(ball):
    return tf.Mesh(ball.vertices, ball.triangles, {"low": [0, 0, -8e-3]})


def test_arrays_are_those_of_scenes(finger, tmp_path):
    def of_keys(**keys):
        return tf.Array.of_scene(finger, set={"array": keys})

    table = tmp_path / "two.csv"
    table.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,5,0,0,1\n12,0,0,0,1,0\n")
    for mine, scene in (
        (tf.Array.grid(5, 3, 10.5e-3, at=[0, 0.01, 0], rotate=[10, 0, 90]),
         of_keys(grid={"count": [5, 3], "pitch_mm": 10.5}, at_mm=[0, 10, 0], rotate_deg=[10, 0, 90])),
        (tf.Array.autd3(2, 1, level=0.5), of_keys(autd3={"layout": [2, 1]}, level=0.5)),
        (tf.Array.autd3(units=[([0, 0, 0.01], [0, 0, 0]), ([0.2, 0, 0], [0, 45, 0])]),
         of_keys(autd3={"units": [{"at_mm": [0, 0, 10]}, {"at_mm": [200, 0, 0], "rotate_deg": [0, 45, 0]}]})),
        (tf.Array.sonicsurface(directivity="piston"), of_keys(sonicsurface={}, directivity="piston")),
        (tf.Array.from_file(table), of_keys(positions={"file": str(table)})),
    ):
        for part in ("positions", "normals", "strengths"):
            assert np.array_equal(getattr(mine, part), getattr(scene, part)), part
    assert np.array_equal(tf.Array([[0, 0, 0], [0.02, 0, 0]]).normals, [[0, 0, 1], [0, 0, 1]])


def test_an_array_of_positions_is_the_same_in_a_scene(ball):
    wave = tf.Wave(50e3)
    array = tf.Array(np.array([[0, 0, -0.1], [0.01, 0, -0.1]]), directivity="piston", level=0.5, piston_radius=5e-3, wave=wave)
    scene = {"array": array, "body": ball, "solve": {"methods": [{"fixed": {"phases_rad": 0}}]}, "evaluation": "none", "frequency_khz": 50}
    points, drives = [[0.03, 0, 0]], [1, 1j]
    for same in (tf.Model(scene).array, tf.Model({**scene, "array": tf.Model({**scene, "frequency_khz": 40}).array}).array):
        assert np.allclose(same.positions, array.positions, atol=1e-15) and np.array_equal(same.strengths, array.strengths)
    assert np.allclose(tf.Model(scene).array.field(points, drives, wave), array.field(points, drives, wave), rtol=1e-12)


def test_free_field_of_one_transducer():
    """p = P0 exp(ikr)/r."""
    array, wave = tf.Array([[0, 0, 0]], directivity="omni", source_strength=2.0), tf.Wave()
    points = np.array([[[0, 0, 0.2], [0.05, 0, 0.3]]])
    r = np.linalg.norm(points, axis=-1)
    assert np.allclose(array.field(points, [0.5j]), 1j * np.exp(1j * wave.k * r) / r, rtol=1e-12)
    assert np.isnan(array.field([[0, 0, 0]], [1])).all()
    both = array.field(points[0], [[1, 0.5j]])
    assert both.shape == (2, 2) and np.array_equal(both[:, 1], array.field(points[0], [0.5j]))
    assert np.allclose(array.transfer(points[0]) @ [0.5j], both[:, 1], rtol=1e-12)


def test_force_is_what_the_metrics_say(model, run):
    for name in run.methods:
        push = tf.force(model.mesh, run.pressures[name], model.wave)
        metrics = model.score(run.pressures[name])
        assert (model.target.shares * push[model.target.faces]).sum() == pytest.approx(metrics["force_target_n"], rel=1e-12)
        assert push.sum() == pytest.approx(metrics["force_target_n"] + metrics["force_elsewhere_n"], rel=1e-9)


def test_moved_meshes_keep_their_landmarks(ball):
    body = marked(ball)
    moved = body.translate([0, 0, 1e-2]).rotate([90, 0, 0]).scale(2, about="low")
    assert moved.landmarks["low"] == pytest.approx([0, -2e-3, 0], abs=1e-12)
    assert moved.volume == pytest.approx(8 * ball.volume, rel=1e-9)
    assert body.rotate([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).normals == pytest.approx(body.rotate([0, 0, 90]).normals, abs=1e-12)
    placed = body.place([0, 0, 0.2], "low", rotate=[0, 90, 0])
    assert placed.landmarks["low"].tolist() == [0, 0, 0.2] and placed.centroids[:, 0].min() > 0
    with pytest.raises(tf.InputError, match="rotation must be a rotation matrix"):
        body.rotate(np.diag([1, 1, -1]))


def test_hands(tmp_path, touchfield):
    skin = tf.hand("fist", edge=6e-3, side="left", breadth=80e-3)
    touchfield("hand", "-o", tmp_path / "fist.ply", "--pose", "fist", "--edge-mm", "6", "--side", "left", "--breadth-mm", "80", "--unit", "m")
    program = tf.read_mesh(tmp_path / "fist.ply", 1.0)
    assert np.array_equal(skin.vertices, program.vertices) and np.array_equal(skin.triangles, program.triangles)
    graded = tf.hand(edge={"far": 9e-3, "near": {"index_pad": 2e-3}, "within": 10e-3}, landmark="index_pad", at=[0, 0, 0.2])
    assert graded.landmarks["index_pad"] == pytest.approx([0, 0, 0.2], abs=1e-4)
    near = np.linalg.norm(graded.centroids - graded.landmarks["index_pad"], axis=1) < 8e-3
    edges = np.sqrt(graded.areas * 4 / np.sqrt(3))
    assert np.mean(edges[near]) < 2.5e-3 and np.mean(edges[~near]) > 3e-3
    bent = tf.hand(edge=6e-3, joints={"index": {"pip_deg": 60}})
    assert np.linalg.norm(bent.landmarks["index_tip"] - tf.hand(edge=6e-3).landmarks["index_tip"]) > 10e-3


def test_targets(ball, target):
    assert np.array_equal(tf.Target(ball, target.faces, 200).amplitudes, target.amplitudes)
    inside = (abs(ball.centroids - [0, 0, -8e-3]) <= [4e-3, 4e-3, 3e-3]).all(axis=1)
    assert set(target.faces[target.shares > 0.9]) <= set(np.flatnonzero(inside)) <= set(target.faces)
    assert np.array_equal(tf.Target(ball, target.faces, 200, target.shares).shares, target.shares)
    assert np.array_equal(tf.Target(ball, target.faces, 200).shares, np.ones(len(target)))
    assert np.linalg.norm(ball.centroids[target.centre][:2]) < 2e-3
    depth = tf.Target.box(marked(ball), "low", [8e-3, 8e-3, 6e-3], 200, offset=[0, 0, 1e-3], profile="penetration")
    assert 150 < depth.amplitudes.max() < 200 and np.ptp(depth.amplitudes) > 10
    for faces, shares, says in [(target.faces, 2 * target.shares, "shares must be > 0 and <= 1"), ([3, 2], None, "faces must ascend")]:
        with pytest.raises(tf.InputError, match=says):
            tf.Target(ball, faces, 200, shares)


def test_targets_on_the_skin(ball):
    low, side = np.array([0, 0, -8e-3]), np.array([8e-3, 0, 0])
    points = tf.Target.points(marked(ball), ["low", side], 5e-3, [200, 50])
    near = np.linalg.norm(ball.centroids - low, axis=1) < 2.2e-3
    assert near.any() and set(np.flatnonzero(near)) <= set(points.faces)
    assert set(points.amplitudes) == {200, 50}
    assert np.array_equal(points.amplitudes == 200, ball.centroids[points.faces][:, 2] < -5e-3)
    line = tf.Target.line(ball, [-side, low, side], 5e-3, 300)
    _, y, z = ball.centroids.T
    assert set(np.flatnonzero((z < -1e-3) & (abs(y) < 2.2e-3))) <= set(line.faces) and set(line.amplitudes) == {300}
    most = line.faces[line.shares > 0.5]
    assert (z[most] < 1e-3).all() and (abs(y[most]) < 2.8e-3).all()
    array = tf.Array.grid(4, 4, at=[0, 0, -0.06])
    mask = tf.Target.mask(ball, np.where(z < -6e-3, 1, np.where(z < -5e-3, 0.25, 0)), 400)
    assert np.array_equal(mask.faces, np.flatnonzero(z < -5e-3)) and np.array_equal(mask.amplitudes == 400, z[mask.faces] < -6e-3)
    assert set(mask.amplitudes) == {400, 100} and np.array_equal(pickle.loads(pickle.dumps(mask)).faces, mask.faces)
    for target in (points, line, mask):
        model = tf.Model({"array": array, "body": marked(ball), "target": target, "solve": {"methods": ["focus"]}})
        assert np.array_equal(model.target.faces, target.faces)
        assert np.allclose(model.target.amplitudes, target.amplitudes, rtol=1e-12)
    with pytest.raises(tf.InputError, match="Target.mask: levels must be 0 to 1, one of them > 0"):
        tf.Target.mask(ball, z, 200)


def test_a_scene_of_objects_is_that_of_the_program(touchfield, ball, array, target, tmp_path):
    body = marked(ball)
    parts = {"name": "parts", "array": array, "body": body, "target": target, "evaluation": "same",
             "solve": {"methods": ["surface", "wgs", "focus"], "iterations": 5}}
    mine = tf.run(parts, threads=2)
    assert "low" in tf.Model(parts).mesh.landmarks
    assert np.array_equal(mine.mesh.vertices, ball.vertices) and np.array_equal(mine.target.faces, target.faces)
    (tmp_path / "parts.yaml").write_text(mine.scene)
    touchfield("run", tmp_path / "parts.yaml", "-o", tmp_path / "out", "--threads", "2", "--quiet")
    with h5py.File(tmp_path / "out/run.h5") as file:
        for name in mine.methods:
            assert np.array_equal(file["methods"][name]["phase"], mine.phases[name])
            assert np.array_equal(file["methods"][name]["pressure"], mine.pressures[name])
    text = tf.run(mine.scene, threads=2)  # as YAML text
    assert np.array_equal(text.pressures["surface"], mine.pressures["surface"])
    changed = tf.run(parts, set={"array": tf.Array.grid(4, 4, at=[0, 0, -0.1]), "solve.methods": ["focus"]})
    assert len(changed.array) == 16


@pytest.mark.parametrize("name", ["surface", "lbfgs", "gs", "wgs", "gs_pat", "eigen", "focus", "paper", "unscattered"])
def test_methods_find_what_the_program_finds(finger, name):
    model = tf.Model(finger, set={"solve.methods": [name, "surface"] if name != "surface" else [name], "solve.iterations": 4,
                                  "solve.optimality_bound": False, "evaluation": "same", "write": ["h5"], "field": []})
    run = tf.run(model, threads=2)
    if name in ("paper", "unscattered"):
        solution = getattr(tf, name)(model, iterations=4, threads=2)
    elif name == "focus":
        row = tf.transfer(model.mesh, model.array, model.wave, faces=model.target.faces, threads=2)
        solution = tf.focus(row, model.target)
        turn = np.angle(np.exp(1j * (solution.phases - run.phases[name])))
        assert abs(turn).max() < 1e-4  # rows of H that were solved together with others
        return
    else:
        options = {} if name == "eigen" else {"iterations": 4}
        solution = getattr(tf, name)(tf.Problem.of_model(model, threads=2), threads=2, **options)
    assert np.array_equal(solution.phases, run.phases[name])
    assert np.array_equal(solution.amplitudes, run.amplitudes[name])


def test_methods_on_h_and_a_target(ball, array, target, h):
    problem = tf.Problem.of(h, target)
    assert np.array_equal(problem.target, h[target.faces]) and np.array_equal(problem.weights, target.shares * ball.areas[target.faces])
    rest = ball.areas.copy()
    rest[target.faces] -= problem.weights
    drives = array.focus([0, 0, -8e-3]).drives
    loud = np.sum(rest * abs(h @ drives) ** 2)
    assert np.sum(abs(problem.outside @ drives) ** 2) == pytest.approx(loud, rel=1e-4)
    least = tf.surface(h, target, iterations=30)
    for method in (tf.lbfgs, tf.gs, tf.wgs, tf.gs_pat, tf.eigen, tf.focus):
        solution = method(h, target)
        assert solution.phases.shape == (len(array),) and problem.cost(solution) >= problem.cost(least) * (1 - 1e-6)
        rows = method(h[target.faces], target)  # of the target alone
        if method is not tf.lbfgs:  # which then has no skin outside the target
            assert np.allclose(np.exp(1j * rows.phases), np.exp(1j * solution.phases), atol=1e-6)
    free = tf.surface(h, target, free_amplitudes=True, start=least)  # from where its cost cannot rise
    assert problem.cost(free) <= problem.cost(least) and free.amplitudes.min() < 1


def test_radiation_finds_what_the_program_finds(finger):
    options = {"outside_weight": 0.2, "free_level": False, "iterations": 30, "tolerances": {"phase_deg": 20}}
    model = tf.Model(finger, set={"solve.methods": [{"radiation": options}, "surface"], "target.pressure_pa": 1500,
                                  "solve.optimality_bound": False, "evaluation": "same", "write": ["h5"], "field": []})
    run = tf.run(model, threads=2)
    problem = tf.RadiationProblem.of_model(model, threads=2)
    solution = tf.radiation(problem, iterations=30, free_level=False, tolerances={"phase": np.deg2rad(20)}, threads=2)
    assert np.allclose(np.exp(1j * solution.phases), np.exp(1j * run.phases["radiation"]), atol=1e-5)
    assert solution.cost_history[-1] == pytest.approx(run.metrics["radiation"]["cost"], rel=1e-6)
    assert run.metrics["radiation"]["relative_error_radiation"] < run.metrics["surface"]["relative_error_radiation"] - 0.05
    pressed = run.radiation["radiation"][problem.faces]
    assert np.allclose(problem.radiation(solution), pressed, atol=2e-3 * pressed.max())
    # Of H, which leaves nothing out.
    whole = tf.RadiationProblem.of(tf.transfer(model.mesh, model.array), model.target, outside_weight=0.2)
    assert np.array_equal(whole.faces, problem.faces) and np.allclose(whole.wanted, problem.wanted, rtol=1e-12)
    assert whole.cost(solution) == pytest.approx(problem.cost(solution), rel=2e-3)


def test_radiation_on_matrices(model):
    sparse = pytest.importorskip("scipy.sparse")
    mesh, array, wave, target = model.mesh, model.array, model.wave, model.target
    h = tf.transfer(mesh, array, wave)
    slopes = sparse.csr_array(tf.surface_slopes(mesh, wave), shape=(2 * len(mesh), len(mesh)))
    rng = np.random.default_rng(1)
    press = 1 / (4 * wave.density * wave.sound_speed**2)
    wanted, inside = np.zeros(len(mesh)), np.zeros(len(mesh))
    wanted[target.faces], inside[target.faces] = target.shares * press * target.amplitudes**2, target.shares
    unit = wanted.max() * (mesh.areas * inside).sum()
    weights, energies = mesh.areas / (unit * wanted.max()), 0.1 * press / unit * mesh.areas * (1 - inside)
    problem = tf.RadiationProblem(h, slopes, wanted, weights, energies, wave)
    q = np.exp(2j * np.pi * rng.random(len(array)))
    p = h @ q
    radiation = press * abs(p) ** 2 - (abs((slopes @ p).reshape(-1, 2)) ** 2).sum(axis=1) * press / wave.k**2
    assert np.allclose(problem.radiation(q), radiation, rtol=1e-9, atol=1e-9 * radiation.max())
    assert problem.cost(q) == pytest.approx((weights * (radiation - wanted) ** 2).sum() + (energies * abs(p) ** 2).sum(), rel=1e-9)
    force = tf.force(mesh, p, wave)
    assert np.allclose(radiation * mesh.areas, force, atol=1e-5 * force.max())  # slopes are of single precision
    found = tf.radiation(problem, iterations=40)
    assert problem.cost(found) < 0.5 * problem.cost(q) and found.cost_history[-1] == pytest.approx(problem.cost(found), rel=1e-4)
    further = tf.radiation(problem, start=found)
    assert problem.cost(further) <= problem.cost(found) * (1 + 1e-5)
    again = pickle.loads(pickle.dumps(problem))
    assert again.cost(q) == problem.cost(q) and np.array_equal(again.faces, problem.faces)
    near = tf.RadiationProblem.of(h, target, wave=wave)
    copy = pickle.loads(pickle.dumps(near))
    assert copy.cost(q) == near.cost(q) and np.array_equal(copy.faces, near.faces) and len(near.faces) < len(mesh)
    # Far skin counts by its energy alone there.
    far = np.setdiff1d(np.arange(len(mesh)), near.faces)
    left = (weights[far] * radiation[far] ** 2).sum()
    shared = weights[target.faces] * inside[target.faces] * (1 - inside[target.faces]) * (press * target.amplitudes**2) ** 2
    assert near.constant == pytest.approx(shared.sum(), rel=1e-9)
    assert near.cost(q) == pytest.approx(problem.cost(q) - left + near.constant, rel=1e-3)
