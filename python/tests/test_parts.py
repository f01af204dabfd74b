import pickle

import numpy as np
import pytest

import touchfield as tf


def test_transfer_is_the_one_of_the_model(model, run):
    h = tf.transfer(model.mesh, model.array, model.wave, threads=2)
    assert h.shape == (len(model.mesh), len(model.array)) and h.flags.writeable
    for name in run.methods:
        drives = run.amplitudes[name] * np.exp(1j * run.phases[name])
        error = np.linalg.norm(h @ drives - run.pressures[name]) / np.linalg.norm(run.pressures[name])
        assert error < 1e-3  # what H leaves out
    rows = tf.transfer(model.mesh, model.array, model.wave, faces=model.target.faces)
    assert np.linalg.norm(rows - h[model.target.faces]) < 1e-3 * np.linalg.norm(rows)


def test_solvers_by_themselves_find_what_the_run_found(model, run):
    problem = tf.Problem.of_model(model, threads=2)
    solution = tf.surface(problem, iterations=8, threads=2)
    assert np.array_equal(solution.phases, run.phases["surface"])
    assert np.array_equal(solution.drives, solution.amplitudes * np.exp(1j * solution.phases))
    assert solution.cost_history[-1] == pytest.approx(problem.cost(solution.drives), rel=1e-9)
    assert solution.iterations == 8 and solution.status == "iteration_limit"
    paper = tf.paper(model, iterations=8, faces="area", threads=2)
    assert np.array_equal(paper.phases, run.phases["paper"])
    assert not np.array_equal(tf.unscattered(model, iterations=8).phases, paper.phases)
    further = tf.surface(problem, iterations=20, start=solution)
    assert further.cost_history[-1] < solution.cost_history[-1]


def test_the_best_pressure_is_that_of_a_run(finger):
    best = tf.Model(finger, set={"target.pressure_pa": "best", "solve.methods": ["surface"], "solve.optimality_bound": False})
    for ask in (lambda: best.target.amplitudes, lambda: pickle.loads(pickle.dumps(best.target)).amplitudes,
                lambda: tf.Problem.of(np.zeros((len(best.target.faces), 64)), best.target)):
        with pytest.raises(tf.InputError, match="Problem.of_model.model..amplitudes has it"):
            ask()
    run, problem = tf.run(best), tf.Problem.of_model(best)
    assert problem.amplitudes.max() == pytest.approx(run.target.amplitudes.max(), rel=1e-9) and problem.amplitudes.max() > 10
    solution = tf.surface(problem, iterations=8)
    evaluated = tf.evaluate(best, solution)
    assert evaluated["mean_inside_pa"] == pytest.approx(run.metrics["surface"]["mean_inside_pa"], rel=1e-3)
    for metrics in (evaluated, best.score(run.pressures["surface"])):
        assert np.isnan([metrics["reached_share"], metrics["scale"]]).all() and metrics["relative_error"] > 0
    silent = {"target.pressure_pa": "best", "solve.methods": [{"fixed": {"phases_rad": 0, "amplitudes": 0}}], "solve.optimality_bound": False}
    with pytest.raises(tf.InputError, match="best is that of fixed, which is silent: give a number"):
        tf.run(finger, set=silent)


def test_drives_of_any_amplitude(model, run, tmp_path):
    half = tf.evaluate(model, 0.5 * np.exp(1j * run.phases["focus"]))
    for metric, share in {"mean_inside_pa": 0.5, "force_target_n": 0.25, "power_share": 0.25, "relative_error": 1}.items():
        assert half[metric] == pytest.approx(share * run.metrics["focus"][metric], rel=1e-6), metric
    free = tf.surface(run.problems["burton_miller_polished"], free_amplitudes=True, iterations=5)
    assert 0 <= free.amplitudes.min() < free.amplitudes.max() <= 1
    whole = np.exp(1j * run.phases["focus"])
    own = tf.run(model, own={"free": free, "whole": whole.astype(np.complex64), "silent": 0j * whole}, threads=2)
    assert np.array_equal(own.amplitudes["free"], free.amplitudes) and np.array_equal(own.phases["free"], free.phases)
    assert (own.amplitudes["whole"] == 1).all() and own.metrics["silent"]["peak_pa"] == 0
    assert tf.evaluate(model, free)["relative_error"] == pytest.approx(own.metrics["free"]["relative_error"], rel=1e-5)
    again = tf.run(own.scene, threads=2)
    assert all(np.array_equal(again.pressures[name], own.pressures[name]) for name in own.methods)
    tf.send(own, method="free", to=f"dry-run:{tmp_path}/frame.txt")
    steps = np.array([line.split()[-1] for line in (tmp_path / "frame.txt").read_text().splitlines()[1:]], int)
    assert np.array_equal(steps, np.floor(0.5 * 255 * own.frames("free")[1][0] + 1e-9))


def test_optimality_bound(model, run):
    problem = tf.Problem.of_model(model, threads=2)
    proof = tf.optimality_bound(problem, threads=2)
    assert proof["bound"] == pytest.approx(run.metrics["surface"]["cost_bound"], rel=1e-9)
    assert 0 < proof["bound"] <= problem.cost(tf.surface(problem, free_level=False).drives)
    with pytest.raises(TypeError, match="problem must be a touchfield.Problem or a touchfield.RadiationProblem, not ndarray"):
        tf.optimality_bound(problem.target)


def test_model_of_a_scene(model, finger):
    assert model.name == "finger" and len(model.target) == len(model.target.amplitudes) > 10
    assert "bottom" in model.mesh.landmarks and model.mesh.landmarks["bottom"] == pytest.approx([0, 0, 0.06], abs=1e-9)
    assert model.wave.wavelength == pytest.approx(343.21 / 40e3) and model.wave.k == pytest.approx(2 * np.pi / model.wave.wavelength)
    assert np.array_equal(tf.Array.of_scene(finger).positions, model.array.positions)
    assert tf.Array.of_scene(finger, set={"array.grid.count": [2, 3]}).positions.shape == (6, 3)
    bare = tf.Model(finger, set={"target": None, "solve.methods": [{"fixed": {"phases_rad": 0}}], "solve.optimality_bound": False, "write": ["h5"], "evaluation": "same"})
    assert bare.target is None and bare.score(np.ones(len(bare.mesh)))["peak_pa"] == 1
    with pytest.raises(tf.InputError, match="no target"):
        tf.Problem.of_model(bare)


def test_check_says_what_the_program_says(touchfield, finger):
    import json

    said = json.loads(touchfield("check", finger, "--json").stdout)
    mine = tf.check(finger)
    timed = ("seconds", "available_mib")
    assert {k: v for k, v in mine.items() if k not in timed} == {k: v for k, v in said.items() if k not in timed}
    assert mine["channels"] == 64
    exact = tf.check(finger, set={"body.edge_mm": 4}, accuracy=True)
    assert exact["accuracy_l2"] > 0
