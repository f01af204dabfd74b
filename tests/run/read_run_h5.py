"""Checks with h5py that run.h5 and motion.h5 are what docs/run-file.md and docs/motion-file.md say: read_run_h5.py
WRITE_SAMPLE_RUN

The samples' values follow formulas (output_support.h, motion_support.h) that are worked out again here. Exit code 77: h5py is missing.
"""

import os
import subprocess
import sys
import tempfile
import zlib

try:
    import h5py
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)


def made_up(count, seed):
    x = np.arange(count) + seed
    return 1000 * np.sin(1.7 * x) + 900j * np.cos(2.3 * x)


def check_same(found, expected):
    # 1e-12 of the largest value: another library's sine and cosine may round differently.
    assert found.shape == expected.shape, (found.shape, expected.shape)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.max(np.abs(expected)))


def check_attributes(item, **expected):
    found = {name: item.attrs[name] for name in expected}
    assert found == expected, found


def check_units(file):
    def has_unit(name, item):
        if isinstance(item, h5py.Dataset):
            assert isinstance(item.attrs["unit"], str), name

    file.visititems(has_unit)


def check(run):
    check_attributes(run, format="touchfield-run", format_version=6, solved_skin="part", name="width \u00fc 5mm", complete=1,
                     resonance_check=0.0125, frequency=40e3, radiation_per_square=1.75e-6)
    assert run["scene"].asstr()[()] == "name: width\nfrequency_khz: 40\n# \u00e9\n"
    check_units(run)

    vertices, triangles, area = (run["mesh"][name][:] for name in ("vertices", "triangles", "area"))
    np.testing.assert_allclose(area, [0.5 * 0.01**2] * 48)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(0.5 * np.linalg.norm(normal, axis=1), area)
    assert np.all(normal[:, 2] < 0)
    assert run["mesh/vertices"].attrs["unit"] == "m" and run["mesh/area"].attrs["unit"] == "m2"

    array = run["array"]
    check_attributes(array, kind="transducers", directivity="t4010a1")
    np.testing.assert_allclose(array["position"][:, 0], [-0.01, 0, 0.01] * 2, atol=1e-15)
    np.testing.assert_allclose(array["axis"][:], [[0, 0, 1]] * 6)
    np.testing.assert_allclose(array["amplitude"][:], [0.5 * 4.0] * 6)
    assert array["amplitude"].attrs["unit"] == "Pa m"
    for name, values in {"array/channel": range(6), "array/device": [0] * 6, "target/face": [3, 4, 10],
                         "target/amplitude": [1000, 2000, 1e-3], "target/box": [0, 0, 1]}.items():
        assert list(run[name]) == list(values), name

    surface = run["methods/surface"]
    check_same(surface["pressure"][:], made_up(48, 0.25))
    check_same(surface["phase"][:], np.abs(made_up(6, 0.25)) / 400)
    assert list(surface["cost"]) == [3.25, 2.0, 1 / 3]
    check_attributes(surface, method="paper", scheme="chief", status="stalled", steps=3, relative_error=0.35, seconds_solve=0.75,
                     seconds_apply=1 / 3, shock_distance_share=2 / 3)
    assert np.isnan(surface.attrs["leakage"])
    assert list(surface.attrs["stages"]) == ["solve", "apply"]
    other = run["methods/paper-2"]
    assert "cost" not in other and other.attrs["status"] == "direct"
    assert np.isnan(other["pressure"][2].real) and np.isposinf(other["pressure"][2].imag)

    transfer = run["transfer/burton_miller"]
    assert transfer["face"] == run["target/face"] and transfer["wanted"] == run["target/amplitude"]
    np.testing.assert_allclose(transfer["weight"][:], run["target/share"][:] * area[run["target/face"][:]])
    for name, (rows, seed, unit) in {"target": (3, 0.5, "Pa"), "outside": (2, 1.5, "Pa m"), "incident": (3, 2.5, "Pa")}.items():
        check_same(transfer[name][:], made_up(rows * 6, seed).reshape(6, rows).T)
        assert transfer[name].attrs["unit"] == unit
    check_attributes(transfer, outside_weight=0.25, channels_left_out=1e-5 / 3, outside_left_out=1e-6 / 7)

    solves = run["solves"]
    for name, values in {"stage": ["pressure", "evaluation"], "scheme": ["burton_miller_polished", "chief"],
                         "solver": ["GMRES, matrix-free", "LU"], "precision": ["single refined", "double"]}.items():
        assert list(solves[name].asstr()) == values, name
    for name, values in {"unknowns": [10842, 80], "right_hand_sides": [3, 1], "steps": [14, 0], "refinements": [2, 0],
                         "converged": [1, 0]}.items():
        assert solves[name].dtype == np.int64 and list(solves[name]) == values, name
    assert solves["residual"][0] == 3.1e-6 and np.isnan(solves["residual"][1])
    assert list(solves["seconds"]) == [1.25, 1 / 3] and solves["seconds"].attrs["unit"] == "s"

    side, cube = run["field/side"], run["field/cube"]
    assert list(side["count"]) == [5, 1, 4] and side["inside"].shape == (4, 1, 5)
    assert cube["inside"].shape == (2, 4, 3) and cube["inside"].dtype == np.uint8
    check_same(cube["pressure/paper-2"][:], made_up(24, 12).reshape(2, 4, 3))
    np.testing.assert_array_equal(cube["inside"][:].ravel(), np.arange(24) % 3 == 0)
    assert list(cube["origin"]) == [-0.01, 0.02, 0.19] and list(cube["spacing"]) == [1e-3, 2e-3, 3e-3]

    assert run["seconds"].attrs["mesh"] == 0.125
    assert list(run["warnings"].asstr()) == ["coarse mesh", 'two, with "quotes"']
    assert list(run["notes"].asstr()) == ["beyond: at 50 mm"]
    assert list(run["resonance_checks"].attrs["stages"]) == ["paper_corrected", "paper"]
    check_attributes(run["provenance"], version="0.1.0", threads=2, seeds="", start="2026-01-01T00:00:00Z", scene_hash="abc")


def check_own_evaluation(run):
    evaluation = run["evaluation"]
    check_attributes(evaluation, evaluation="edge", scheme="burton_miller_polished")
    np.testing.assert_allclose(evaluation["mesh/area"][:], [0.5 * 0.0075**2] * 80)
    assert list(evaluation["target/face"]) == [5, 6, 17, 18]
    assert list(evaluation["target/amplitude"]) == [1e-3, 7, 1000, 2000]
    assert list(evaluation["target/box"]) == [0, 0, 0, 1]
    check_same(evaluation["methods/surface/pressure"][:], made_up(80, 3.5))
    check_same(evaluation["methods/surface/radiation"][:], made_up(80, 3.5).real)
    assert "radiation" not in evaluation["methods/paper-2"] and "radiation" not in run["methods/surface"]
    other = evaluation["methods/paper-2/pressure"][:]
    assert np.isnan(other[7])
    check_same(np.delete(other, 7), np.delete(made_up(80, 4.5), 7))


def check_same_evaluation(run):
    evaluation = run["evaluation"]
    assert evaluation.attrs["evaluation"] == "same" and "scheme" not in evaluation.attrs
    assert evaluation["mesh"] == run["mesh"] and evaluation["target"] == run["target"]
    assert evaluation["methods/surface/pressure"] == run["methods/surface/pressure"]
    assert evaluation["methods/surface/radiation"] == run["methods/surface/radiation"]
    check_same(run["methods/surface/radiation"][:], made_up(48, 0.25).real)
    check_same(evaluation["methods/paper-2/pressure"][:], made_up(48, 4.5))


def check_motion(motion):
    check_attributes(motion, format="touchfield-motion", format_version=5, solved_skin="whole", complete=1, seconds=0.2)
    check_units(motion)
    assert motion["mesh/triangles"].shape == (48, 3) and motion["evaluation/mesh/triangles"].shape == (80, 3)
    assert list(motion["methods"]) == ["surface", "paper-2"]
    method = motion["methods/paper-2"]
    check_attributes(method, method="surface", scheme="chief", dropped=3)
    frames, scores = method["frames"], method["scores"]
    np.testing.assert_allclose(frames["sampled"][:], np.arange(4) / 30)
    np.testing.assert_allclose(frames["shown"][:], np.arange(4) / 20 + 0.022)
    assert list(frames["silent"]) == [0, 1, 0, 0] and list(frames["steps"]) == [2, 0, 2, 2]
    assert list(frames["status"].asstr()) == ["iteration_limit", "direct", "iteration_limit", "iteration_limit"]
    check_same(frames["phases"][3], np.abs(made_up(6, 10.5)) / 400)
    assert frames["phases"].shape == (4, 6) and not frames["amplitudes"][1].any()
    assert frames["cost"].shape == (4, 4)
    np.testing.assert_array_equal(frames["cost"][:], [[10.5, 2, 1 / 3, np.nan], [np.nan] * 4, [10.5, 2, 0.2, 0.125],
                                                      [10.5, 2, 1 / 6, np.nan]])
    assert list(frames["seconds"]) == ["pose", "factorisation"]
    np.testing.assert_allclose(frames["seconds/factorisation"][:], [0.01, np.nan, 0.012, 0.013])
    assert list(scores["frame"]) == [-1, -1, 0, 1, 2, 3] and np.isnan(scores["age"][1])
    assert scores["displacement"].shape == (6, 3) and scores["displacement"][5, 1] == -2e-3
    np.testing.assert_allclose(scores["relative_error"][2:], [0.575, 0.675, 0.775, 0.875])
    assert scores["mean_inside_pa"].attrs["unit"] == "Pa" and np.isnan(scores["leakage"][:]).all()


with tempfile.TemporaryDirectory() as directory:
    path = os.path.join(directory, "run.h5")
    self_evaluated = os.path.join(directory, "self_evaluated.h5")
    moving = os.path.join(directory, "motion.h5")
    subprocess.run([sys.argv[1], path, self_evaluated, moving], check=True)
    with h5py.File(path, "r") as file:
        check(file)
        check_own_evaluation(file)
    with h5py.File(self_evaluated, "r") as file:
        check(file)
        check_same_evaluation(file)
    with h5py.File(moving, "r") as file:
        check_motion(file)
    with open(path, "rb") as file:
        content = file.read()
    assert content[-26:] == b"touchfield-crc32 %08x\n" % zlib.crc32(content[:-26])
print("run.h5 and motion.h5 are as described")
