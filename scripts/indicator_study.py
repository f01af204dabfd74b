#!/usr/bin/python3 -I
"""Relates the accuracy indicator to the scattering error: scheme, mesh, indicator, split mesh, error.

usage: scripts/indicator_study.py [PROGRAM [CSV]]     (default: build/release/apps/touchfield, results/tables/indicator.csv)

The error is that of the pressure in a plane wave. The reference on spheres is the exact series. Elsewhere it is the polished scheme
on the mesh with every face split in four (twice on the capsule).
"""

import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "report"))

from measuring import ROOT, begin  # noqa: E402

begin(__doc__)

from runs import made_by, write_table  # noqa: E402
from sphere_series import K, plane_wave_errors  # noqa: E402
from support import PROGRAM, open_run  # noqa: E402

SCENE = """\
name: body
array: {{plane_wave: {{direction: [0, 0, 1]}}}}
body: {{{body}, edge_mm: {edge}}}
solve: {{methods: [{{fixed: {{phases_rad: 0}}}}], resonance_check: never}}
evaluation: {evaluation}
write: [h5]
"""


def sphere(ka, edge):
    return f"sphere ka {ka:g}", f"sphere: {{radius_mm: {1e3 * ka / K!r}}}", edge, 0, ka / K


BODIES = [
    sphere(6, 2.2), sphere(6, 1.3), sphere(13, 2.2), sphere(13, 1.34), sphere(3.14159265, 1.3),
    ("capsule", "capsule: {radius_mm: 8, length_mm: 20}", 2.5, 2, None),
    ("capsule", "capsule: {radius_mm: 8, length_mm: 20}", 1.7, 2, None),
    ("hand", "hand: {breadth_mm: 55, length_mm: 125}", 2.8, 1, None),
    ("hand", "hand: {breadth_mm: 55, length_mm: 125}", 1.72, 1, None),
]


def measure(body, edge, splits, radius, scheme, folder):
    scene = pathlib.Path(folder) / "scene.yaml"
    evaluation = f"{{scheme: burton_miller_polished, split: {splits}}}" if splits else "none"
    scene.write_text(SCENE.format(body=body, edge=edge, evaluation=evaluation))
    chosen = ["--set", f"solve.scheme={scheme}"]
    report = json.loads(subprocess.run([PROGRAM, "check", str(scene), "--accuracy", "--json", *chosen], check=True,
                                       capture_output=True, text=True).stdout)
    subprocess.run([PROGRAM, "run", str(scene), "-o", folder + "/out", "--force", "--quiet", *chosen], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open_run(folder + "/out") as run:
        if radius is None:
            return report, float(run["methods/fixed"].attrs["evaluation_difference"])
        return report, plane_wave_errors(run, radius, ["fixed"])["fixed"]


rows = []
for name, body, edge, splits, radius in BODIES:
    for scheme in ["paper_corrected", "burton_miller", "burton_miller_polished"]:
        with tempfile.TemporaryDirectory() as folder:
            report, error = measure(body, edge, splits, radius, scheme, folder)
        split = report["accuracy_split"]
        rows.append({"body": name, "edges a wavelength": f"{report['epw_mean']:.1f}", "faces": report["faces"], "scheme": scheme,
                     "indicator, rms": f"{report['accuracy_l2']:.6g}", "worst": f"{report['accuracy_max']:.6g}",
                     "split mesh": "" if split is None else f"{split:.6g}", "error": f"{error:.6g}"})
        print(*rows[-1].values(), flush=True)
write_table(sys.argv[2] if len(sys.argv) > 2 else ROOT / "results/tables/indicator.csv", rows,
            made_by("scripts/indicator_study.py", PROGRAM))
