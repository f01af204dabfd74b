"""What passes between processes and libraries: pickles, copies, arrays without copies, executors, meshes of others."""

import concurrent.futures
import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import touchfield as tf


@pytest.fixture(scope="module")
def ball():
    return tf.Mesh(tf.sphere(8e-3, 3e-3).vertices, tf.sphere(8e-3, 3e-3).triangles, {"low": [0, 0, -8e-3]})


@pytest.fixture(scope="module")
def h(ball):
    return tf.transfer(ball, tf.Array.grid(4, 4, at=[0, 0, -0.1]))


def test_pickles_and_copies(ball, h, run, model, finger):
    target = tf.Target.box(ball, "low", [8e-3, 8e-3, 6e-3], 200)
    problem = tf.Problem.of(h, target)
    array = tf.Array.of_scene(finger, set={"array.directivity": "piston"})
    for make in (lambda part: pickle.loads(pickle.dumps(part)), copy.copy, copy.deepcopy):
        mesh = make(ball)
        assert np.array_equal(mesh.normals, ball.normals) and mesh.landmarks["low"].tolist() == [0, 0, -8e-3]
        assert make(tf.Wave(41e3, temperature=30)).wavelength == tf.Wave(41e3, temperature=30).wavelength
        drives = np.exp(1j * np.arange(64))
        assert np.array_equal(make(array).field([[0, 0, 0.1]], drives), array.field([[0, 0, 0.1]], drives))
        assert np.array_equal(make(target).faces, target.faces) and make(target)._scene_keys() == target._scene_keys()
        assert make(problem).cost(np.ones(16)) == problem.cost(np.ones(16))
        assert np.array_equal(make(tf.gs(problem)).phases, tf.gs(problem).phases)
        assert np.array_equal(make(model).mesh.vertices, model.mesh.vertices) and make(model).scene == model.scene
        other = make(run)
        assert other.metrics["paper"]["leakage"] == run.metrics["paper"]["leakage"]
        assert np.array_equal(other.evaluation_pressures["surface"], run.evaluation_pressures["surface"])
    for error in (tf.InputError("no"), tf.DeviceError("no")):
        assert type(pickle.loads(pickle.dumps(error))) is type(error)


def test_a_model_of_objects_pickles(ball):
    scene = {"array": tf.Array.grid(4, 4, at=[0, 0, -0.1]), "body": ball, "solve": {"methods": ["focus"]}, "evaluation": "same",
             "target": tf.Target.box(ball, "low", [8e-3, 8e-3, 6e-3], 200)}
    model = tf.Model(scene)
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as executor:
        found = executor.submit(tf.run, model).result()
    assert np.array_equal(found.phases["focus"], tf.run(model).phases["focus"])


def test_h_goes_to_others_without_a_copy(h):
    assert h.flags.owndata or h.base is not None
    same = np.from_dlpack(h)
    assert same.__array_interface__["data"][0] == h.__array_interface__["data"][0] and same.shape == h.shape


def test_h_in_pytorch(h):
    torch = pytest.importorskip("torch")
    tensor = torch.from_dlpack(h)
    assert tensor.data_ptr() == h.__array_interface__["data"][0] and tensor.shape == h.shape
    drives = torch.exp(1j * torch.linspace(0, 6, 16, dtype=torch.float64))
    assert np.allclose((tensor @ drives).numpy(), h @ drives.numpy())


def test_h_in_jax(h):
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)  # else it makes single precision of it
    taken = jax.numpy.from_dlpack(h)
    assert taken.unsafe_buffer_pointer() == h.__array_interface__["data"][0] and taken.shape == h.shape
    drives = np.exp(1j * np.linspace(0, 6, 16))
    assert np.allclose(jax.jit(lambda q: taken @ q)(drives), h @ drives)


def test_meshes_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    body = trimesh.creation.icosphere(3, 8.0)
    mesh = tf.Mesh.from_trimesh(body, unit=1e-3, landmarks={"top": [0, 0, 8]})
    assert mesh.volume == pytest.approx(1e-9 * body.volume) and mesh.landmarks["top"].tolist() == [0, 0, 8e-3]
    back = mesh.to_trimesh()
    assert np.array_equal(back.vertices, mesh.vertices) and np.array_equal(back.faces, mesh.triangles) and back.is_watertight


def test_meshes_of_pyvista():
    pyvista = pytest.importorskip("pyvista")
    mesh = tf.Mesh.from_pyvista(pyvista.Sphere(8.0), unit=1e-3)
    shown = mesh.to_pyvista(area=mesh.areas)
    assert shown.n_cells == len(mesh) and np.array_equal(shown.cell_data["area"], mesh.areas)


def test_sweeps_by_an_executor(finger, tmp_path):
    plan = {"base": finger, "set": {"solve.methods": ["focus"], "solve.optimality_bound": False, "evaluation": "same", "write": ["h5"], "field": []},
            "grid": {"target.pressure_pa": [400, 500, 600]}}
    told = []
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        table = tf.sweep(plan, tmp_path / "out", executor=executor, threads=1, progress=lambda stage, share: told.append(share))
    assert table["target.pressure_pa"].tolist() == [400, 500, 600] and table["status"].tolist() == ["ok"] * 3 and told[-1] == 1
    own = tf.sweep(plan, tmp_path / "own", threads=1, jobs=1)
    assert np.array_equal(own["relative_error"], table["relative_error"])
    pytest.importorskip("matplotlib")
    axes = table.figure("target.pressure_pa", ["relative_error", "peak_pa"], by="case", width="double").axes
    assert [ax.get_title() for ax in axes] == ["case = 1", "case = 2", "case = 3"] + [""] * 3
    assert axes[4].lines[0].get_xydata().tolist() == [[500, table["peak_pa"][1]]]
    assert [ax.get_ylabel() for ax in axes[::3]] == ["relative error [%]", "peak [Pa]"]
    with pytest.raises(tf.InputError, match="sweep: there is no column 'height'"):
        table.figure("case", by="height")
