import gc

import h5py
import numpy as np
import pytest

import touchfield as tf


def test_shipped_scenes():
    assert {"quick", "circle", "width_8mm"} <= set(tf.scenes())
    assert tf.scene("quick").startswith("#") and "name: quick" in tf.scene("quick")
    with pytest.raises(tf.InputError, match="quik: no scene that comes with the package"):
        tf.scene("quik")
    with pytest.raises(tf.InputError, match="quik: no such file, and no scene that comes with the program: .*quick"):
        tf.Model("quik")
    assert tf.Model("capsule").mesh.vertices.shape == tf.Model(tf.scene("capsule")).mesh.vertices.shape


def test_equals_the_program_to_the_last_bit(touchfield, finger, run, tmp_path):
    touchfield("run", finger, "-o", tmp_path / "out", "--threads", "2", "--quiet")
    with h5py.File(tmp_path / "out/run.h5") as file:
        assert np.array_equal(file["mesh/vertices"], run.mesh.vertices)
        assert np.array_equal(file["mesh/triangles"], run.mesh.triangles)
        assert np.array_equal(file["array/position"], run.array.positions)
        assert np.array_equal(file["target/face"], run.target.faces)
        assert np.array_equal(file["target/amplitude"], run.target.amplitudes)
        assert run.methods == ["surface", "paper", "focus"]
        for name in run.methods:
            kept = file["methods"][name]
            assert np.array_equal(kept["phase"], run.phases[name])
            assert np.array_equal(kept["amplitude"], run.amplitudes[name])
            assert np.array_equal(kept["pressure"], run.pressures[name])
            assert np.array_equal(file[f"evaluation/methods/{name}/pressure"], run.evaluation_pressures[name])
            assert np.array_equal(file[f"evaluation/methods/{name}/radiation"], run.radiation[name])
            for metric, value in run.metrics[name].items():
                if not metric.startswith("seconds"):
                    assert np.array_equal(kept.attrs[metric], value, equal_nan=True), metric
            assert np.array_equal(file[f"field/side/pressure/{name}"], run.fields["side"][name])


def test_arrays_look_at_the_run_and_keep_it(finger):
    once = tf.run(finger, set={"solve.methods": ["focus"], "solve.optimality_bound": False, "evaluation": "same"})
    pressure, vertices, faces = once.pressures["focus"], once.mesh.vertices, once.target.faces
    assert once.pressures["focus"].__array_interface__["data"][0] == pressure.__array_interface__["data"][0]
    kept = pressure.copy(), vertices.copy(), faces.copy()
    del once
    gc.collect()
    tf.sphere(0.01, 0.001)  # takes what memory was let go of
    assert all(np.array_equal(a, b) for a, b in zip((pressure, vertices, faces), kept))
    for array in (pressure, vertices, faces):
        assert not array.flags.writeable and not array.flags.owndata
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_saved_and_read_again(run, tmp_path):
    run.save(tmp_path / "one.h5")
    run.save(tmp_path / "folder")
    for path in ("one.h5", "folder", "folder/run.h5"):
        read = tf.read_run(tmp_path / path)
        assert read.methods == run.methods and read.scene == run.scene
        assert np.array_equal(read.pressures["surface"], run.pressures["surface"])
        assert np.array_equal(read.fields["side"]["paper"], run.fields["side"]["paper"])
    whole = (tmp_path / "one.h5").read_bytes()
    (tmp_path / "edited.h5").write_bytes(whole[: whole.rindex(b"touchfield-crc32")])
    with pytest.warns(tf.TouchfieldWarning, match="checksum line"):
        assert tf.read_run(tmp_path / "edited.h5").methods == run.methods
    written = {path.name for path in (tmp_path / "folder").iterdir()}
    assert {"run.h5", "metrics.csv", "surface.vtp", "side.vti", "overview.png"} <= written
    assert "failed.json" not in written
    for path in ("one.h5", "folder"):
        with pytest.raises(tf.InputError, match="force|--force"):
            run.save(tmp_path / path)
        run.save(tmp_path / path, force=True)


def test_pictures_are_the_program_s(run, tmp_path):
    run.save(tmp_path / "folder")
    picture = run.picture("field_side")
    picture.save(tmp_path / "side.png")
    assert len(bytes(picture)) > 10000
    assert bytes(picture) == (tmp_path / "folder/field_side.png").read_bytes() == (tmp_path / "side.png").read_bytes()
    assert run._repr_png_() == bytes(run.picture()) == run.picture("overview")._repr_png_()
    with pytest.raises(tf.InputError, match="no picture is called 'other'; the pictures are overview, field_side"):
        run.picture("other")


def test_fields(run):
    side = run.fields["side"]
    assert side["surface"].shape == (16, 1, 11) and side["points"].shape == (16, 1, 11, 3)
    outside = side["surface"] != 0
    at = side["points"][outside]
    assert np.allclose(run.field(at)["surface"], side["surface"][outside], rtol=1e-6)
    drives = run.amplitudes["surface"] * np.exp(1j * run.phases["surface"])
    wave = tf.Wave(frequency=40e3, temperature=20)
    again = tf.field(run.evaluation_mesh, run.array, run.evaluation_pressures["surface"], drives, at, wave)
    assert np.allclose(again, side["surface"][outside], rtol=1e-6)


def test_problem_that_the_run_kept(run):
    problem = next(iter(run.problems.values()))
    drives = np.exp(1j * run.phases["surface"]) * run.amplitudes["surface"]
    assert problem.target.shape == (len(run.target), len(run.array))
    cost = np.sum(problem.weights * (abs(problem.target @ drives) - problem.amplitudes) ** 2) + np.sum(abs(problem.outside @ drives) ** 2)
    assert problem.cost(drives) == pytest.approx(cost)
    assert run.metrics["surface"]["cost_skin"] == pytest.approx(cost, rel=1e-6)


def test_figures_are_of_the_whole_skin(finger, run):
    assert run.solved_skin == "whole"
    part = {"body.keep_within_mm": 13, "solve.methods": ["focus"], "solve.optimality_bound": False, "write": ["h5"]}
    cut = tf.run(finger, set={**part, "evaluation": "same"})
    assert cut.solved_skin == "part" and len(cut.evaluation_mesh) > len(cut.mesh)
    assert np.isnan(tf.run(finger, set={**part, "evaluation": "none"}).metrics["focus"]["relative_error"])
    model = tf.Model(finger, set=part)
    with pytest.raises(tf.InputError, match="count its whole skin"):
        model.score(np.ones(len(model.mesh)))


def test_levels_at_points_are_of_the_field_there(finger):
    at = [-80, 30, 300]
    run = tf.run(finger, set={"solve.methods": ["surface", "focus"], "evaluation": "same", "write": ["h5"], "field": [
        {"name": "ear", "at_mm": at}, {"name": "arm", "at_mm": [0, 100, 80]}]})
    assert [(row["point"], row["method"]) for row in run.levels] == [
        ("ear", "surface"), ("ear", "focus"), ("arm", "surface"), ("arm", "focus")]
    pressure = run.field([np.array(at) * 1e-3])
    for row in run.levels[:2]:
        assert row["amplitude_pa"] == abs(run.fields["ear"][row["method"]][0, 0, 0])
        assert np.isclose(row["amplitude_pa"], abs(pressure[row["method"]][0]), rtol=1e-12)
        assert np.isclose(row["level_db"], 20 * np.log10(row["amplitude_pa"] / (np.sqrt(2) * 20e-6)), rtol=0, atol=1e-9)
    assert {row["limit_db"] for row in run.exposure_limits} == {100, 110, 115}
