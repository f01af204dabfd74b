#!/usr/bin/python3
"""Error of solved spheres against the exact series, for every scheme: relative L2 of the complex pressure.

usage: scripts/sphere_accuracy.py [PROGRAM [CSV]]     (default: build/release/apps/touchfield, results/tables/spheres.csv)
"""

import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
os.environ["TOUCHFIELD_PROGRAM"] = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/release/apps/touchfield")
os.environ["TOUCHFIELD_SOURCE_DIR"] = str(ROOT)
sys.path[:0] = [str(ROOT / "tests/cli"), str(ROOT / "scripts/report")]

import numpy  # noqa: E402
from runs import made_by, write_table  # noqa: E402
from sphere_series import K, plane_wave  # noqa: E402
from support import PROGRAM, faces, open_run, relative_l2  # noqa: E402

SCHEMES = ["paper", "paper_corrected", "chief", "burton_miller", "burton_miller_polished"]
SCENE = """\
name: sphere
array: {{plane_wave: {{direction: [0, 0, 1]}}}}
body: {{sphere: {{radius_mm: {radius!r}}}, edge_mm: {edge!r}}}
solve: {{methods: [{methods}], alarm: never}}
judge: none
write: [h5]
"""


def measure(ka, edges_a_wavelength):
    """Number of faces, and the error of each scheme."""
    wavelength = 2 * math.pi / K * 1e3
    radius = ka / K * 1e3
    methods = ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in SCHEMES)
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder) / "scene.yaml"
        scene.write_text(SCENE.format(radius=radius, edge=wavelength / edges_a_wavelength, methods=methods))
        subprocess.run([PROGRAM, "run", str(scene), "-o", folder + "/out", "--quiet"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open_run(folder + "/out") as run:
            centroid, area = faces(run)
            pressures = [run[f"methods/{scheme}/pressure"][:] for scheme in SCHEMES]
    exact = plane_wave(radius * 1e-3, centroid[:, 2] / numpy.linalg.norm(centroid, axis=1))
    return len(area), [relative_l2(area, p, exact) for p in pressures]


rows = []
for ka in [5.10, 5.858277, math.pi, 4.493409, 9.424778]:
    for edges in [3, 4, 6, 10] if ka < 7 else [3, 4, 6]:
        count, errors = measure(ka, edges)
        rows.append({"ka": f"{ka:.4f}", "edges a wavelength": edges, "faces": count,
                     **{scheme: f"{error:.6g}" for scheme, error in zip(SCHEMES, errors)}})
        print(*rows[-1].values(), flush=True)
write_table(sys.argv[2] if len(sys.argv) > 2 else ROOT / "results/tables/spheres.csv", rows,
            made_by("scripts/sphere_accuracy.py", PROGRAM))
