"""Checks with h5py that run.h5 is what docs/run-file.md says: read_run_h5.py WRITE_SAMPLE_RUN

The sample's values follow formulas (output_support.h) that are worked out again here. Exit code 77: h5py is missing.
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


def check(run):
    assert run.attrs["format"] == "touchfield-run"
    assert run.attrs["format_version"] == 1
    assert run.attrs["name"] == "width \u00fc 5mm"
    assert run.attrs["complete"] == 1
    assert run["scene"].asstr()[()] == "name: width\nfrequency_khz: 40\n# \u00e9\n"

    def has_unit(name, item):
        if isinstance(item, h5py.Dataset):
            assert isinstance(item.attrs["unit"], str), name

    run.visititems(has_unit)

    vertices, triangles, area = (run["mesh"][name][:] for name in ("vertices", "triangles", "area"))
    assert vertices.shape == (35, 3) and triangles.shape == (48, 3) and area.shape == (48,)
    np.testing.assert_allclose(area, 0.5 * 0.01**2)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(0.5 * np.linalg.norm(normal, axis=1), area)
    assert np.all(normal[:, 2] < 0)
    assert run["mesh/vertices"].attrs["unit"] == "m" and run["mesh/area"].attrs["unit"] == "m2"

    array = run["array"]
    assert array.attrs["kind"] == "transducers" and array.attrs["directivity"] == "t4010a1"
    assert array["position"].shape == (6, 3) and array["axis"].shape == (6, 3)
    np.testing.assert_allclose(array["position"][:, 0], [-0.01, 0, 0.01] * 2, atol=1e-15)
    np.testing.assert_allclose(array["axis"][:], [[0, 0, 1]] * 6)
    np.testing.assert_allclose(array["amplitude"][:], 0.5 * 4.0)
    assert array["amplitude"].attrs["unit"] == "Pa m"
    assert list(array["channel"]) == [0, 1, 2, 3, 4, 5] and list(array["device"]) == [0] * 6

    assert list(run["target/face"]) == [3, 4, 10]
    assert list(run["target/amplitude"]) == [1000, 2000, 1e-3]
    assert list(run["target/box"]) == [0, 0, 1]

    surface = run["methods/surface"]
    assert surface["pressure"].dtype == np.complex128
    check_same(surface["pressure"][:], made_up(48, 0.25))
    check_same(surface["phase"][:], np.abs(made_up(6, 0.25)) / 400)
    assert list(surface["cost"]) == [3.25, 2.0, 1 / 3]
    assert surface.attrs["method"] == "paper" and surface.attrs["scheme"] == "chief"
    assert surface.attrs["status"] == "stalled" and surface.attrs["steps"] == 3
    assert surface.attrs["relative_error"] == 0.35 and np.isnan(surface.attrs["leakage"])
    assert surface.attrs["seconds_solve"] == 0.75 and surface.attrs["seconds_apply"] == 1 / 3
    assert list(surface.attrs["stages"]) == ["solve", "apply"]
    other = run["methods/paper-2"]
    assert "cost" not in other and other.attrs["status"] == "direct"
    assert np.isnan(other["pressure"][2].real) and np.isposinf(other["pressure"][2].imag)

    assert run["judge"].attrs["judge"] == "same"
    assert run["judge/mesh"] == run["mesh"] and run["judge/target"] == run["target"]
    assert run["judge/methods/surface/pressure"] == surface["pressure"]

    side, cube = run["field/side"], run["field/cube"]
    assert list(side["count"]) == [5, 1, 4] and side["inside"].shape == (4, 1, 5)
    assert cube["inside"].shape == (2, 4, 3) and cube["inside"].dtype == np.uint8
    check_same(cube["pressure/paper-2"][:], made_up(24, 12).reshape(2, 4, 3))
    np.testing.assert_array_equal(cube["inside"][:].ravel(), np.arange(24) % 3 == 0)
    assert list(cube["origin"]) == [-0.01, 0.02, 0.19] and list(cube["spacing"]) == [1e-3, 2e-3, 3e-3]

    assert run["seconds"].attrs["mesh"] == 0.125
    assert list(run["warnings"].asstr()) == ["coarse mesh", 'two, with "quotes"']
    provenance = run["provenance"].attrs
    assert provenance["version"] == "0.1.0" and provenance["threads"] == 2 and provenance["seeds"] == ""
    assert provenance["start"] == "2026-01-01T00:00:00Z" and provenance["scene_hash"] == "abc"


with tempfile.TemporaryDirectory() as directory:
    path = os.path.join(directory, "run.h5")
    subprocess.run([sys.argv[1], path], check=True)
    with h5py.File(path, "r") as file:
        check(file)
    with open(path, "rb") as file:
        content = file.read()
    assert content[-26:] == b"touchfield-crc32 %08x\n" % zlib.crc32(content[:-26])
print("run.h5 is as described")
