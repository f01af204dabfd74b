#!/usr/bin/python3 -I
"""Error of solved spheres against the exact series, for every scheme: relative L2 of the complex pressure.

usage: scripts/sphere_accuracy.py [PROGRAM [FOLDER]]     (default: build/release/apps/touchfield, results/tables)

  spheres.csv             the built-in sphere
  spheres_from_files.csv  finer icospheres from mesh files
  sphere_sizes.csv        time and memory of the whole process for those
"""

import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "report"))

from measuring import ROOT, begin  # noqa: E402

begin(__doc__)

from meshes import icosphere, write_ply  # noqa: E402
from runs import made_by, write_table  # noqa: E402
from sphere_series import K, plane_wave_errors  # noqa: E402
from support import PROGRAM, open_run  # noqa: E402

SCHEMES = ["paper", "paper_corrected", "chief", "burton_miller", "burton_miller_polished"]
SCENE = """\
name: sphere
array: {{plane_wave: {{direction: [0, 0, 1]}}}}
body: {body}
solve: {{methods: [{methods}], resonance_check: never}}
evaluation: none
write: [h5]
"""


def errors(body, radius, schemes, folder):
    """Number of faces of the body, a sphere of this radius [m], the error of each scheme, and what the process took: seconds, GiB."""
    methods = ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in schemes)
    scene = pathlib.Path(folder) / "scene.yaml"
    scene.write_text(SCENE.format(body=body, methods=methods))
    began = time.monotonic()
    process = subprocess.Popen([PROGRAM, "run", str(scene), "-o", folder + "/out", "--quiet"], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    taken = time.monotonic() - began, usage.ru_maxrss / 2**20
    if status:
        sys.exit(f"scripts/sphere_accuracy.py: {PROGRAM} has failed on {body}")
    with open_run(folder + "/out") as run:
        return len(run["mesh/area"]), plane_wave_errors(run, radius, schemes), taken


def built_in(ka, edges_a_wavelength):
    edge = 2 * math.pi / K * 1e3 / edges_a_wavelength
    with tempfile.TemporaryDirectory() as folder:
        return errors(f"{{sphere: {{radius_mm: {ka / K * 1e3!r}}}, edge_mm: {edge!r}}}", ka / K, SCHEMES, folder)


def from_file(ka, splits, schemes):
    """On 20 x 4^splits faces, by way of a mesh file."""
    with tempfile.TemporaryDirectory() as folder:
        write_ply(pathlib.Path(folder) / "sphere.ply", *icosphere(splits, ka / K * 1e3))
        return errors("{mesh: {file: sphere.ply, unit: mm}}", ka / K, schemes, folder)


tables = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "results/tables")
made = made_by("scripts/sphere_accuracy.py", PROGRAM)
rows = []
for ka in [5.10, 5.858277, math.pi, 4.493409, 9.424778]:
    for edges in [3, 4, 6, 10] if ka < 7 else [3, 4, 6]:
        count, found, _ = built_in(ka, edges)
        rows.append({"ka": f"{ka:.4f}", "edges a wavelength": edges, "faces": count,
                     **{scheme: f"{error:.6g}" for scheme, error in found.items()}})
        print(*rows[-1].values(), flush=True)
write_table(tables / "spheres.csv", rows, made)

rows = []
for ka, splits, schemes in [(13, 4, SCHEMES[1:]), (25, 5, SCHEMES[3:])]:
    count, found, _ = from_file(ka, splits, schemes)
    edge = math.sqrt(4 / math.sqrt(3) * 4 * math.pi * ka**2 / count)  # times k, of an equilateral face
    for scheme, error in found.items():
        rows.append({"ka": ka, "faces": count, "edges a wavelength": f"{2 * math.pi / edge:.1f}", "scheme": scheme,
                     "error": f"{error:.6g}"})
        print(*rows[-1].values(), flush=True)
write_table(tables / "spheres_from_files.csv", rows, made)

rows = []
for ka, splits in [(13, 4), (25, 5), (50, 6)]:
    count, found, (seconds, gib) = from_file(ka, splits, SCHEMES[4:])
    rows.append({"faces": f"{count:,}", "ka": ka, "seconds": f"{seconds:.2g}", "GiB": f"{gib:.2g}", "error": f"{100 * found[SCHEMES[4]]:.2f} %"})
    print(*rows[-1].values(), flush=True)
write_table(tables / "sphere_sizes.csv", rows, made)
