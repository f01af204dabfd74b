#!/usr/bin/python3 -I
"""Whole runs on the first graphics card and on two of its machine's cores: a sphere, and a sweep of heights.

usage: scripts/gpu_runs.py [PROGRAM [FOLDER]]     (default: build/release/apps/touchfield, results/tables)

Writes gpu_runs.csv, in four minutes: seconds and the error of the card's results. For the sphere the reference is the exact series.
For the sweep it is the processor's evaluated error, in points. The card computes all twenty heights. The processor computes the
first three. The second and third, which reuse the first one's matrices, give the time of the others.
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
from runs import made_by, table, write_table  # noqa: E402
from sphere_series import K, plane_wave_errors  # noqa: E402
from support import PROGRAM, open_run  # noqa: E402

SPHERE = """\
name: sphere
array: {plane_wave: {direction: [0, 0, 1]}}
body: {mesh: {file: sphere.ply, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0, scheme: burton_miller_polished}}], resonance_check: never}
evaluation: none
write: [h5]
"""
SPHERE_KA = 25
HEIGHTS = [150 + 10 * i for i in range(20)]


def touchfield(device, *arguments):
    """Seconds from start to end."""
    pinned = ["taskset", "-c", "0,1"] if device == "cpu" else []
    threads = {"OMP_NUM_THREADS": "2"} if device == "cpu" else {}
    began = time.monotonic()
    done = subprocess.run([*pinned, PROGRAM, *map(str, arguments)], env=os.environ | threads, capture_output=True, text=True,
                          check=False)
    if done.returncode:
        sys.exit(f"scripts/gpu_runs.py: {done.stderr}")
    return time.monotonic() - began


def row(work, count, card, processor, off):
    return {"work": work, "faces": count, "card_s": f"{card:.3g}", "processor_s": f"{processor:.3g}",
            "ratio": f"{processor / card:.1f}", "off": f"{off:.2g}"}


def sphere(folder):
    """Pressures of one plane wave; the start of the card apart."""
    write_ply(folder / "sphere.ply", *icosphere(5, SPHERE_KA / K * 1e3))
    (folder / "sphere.yaml").write_text(SPHERE)
    seconds = {}
    for device in ("cpu", "cuda"):
        touchfield(device, "run", folder / "sphere.yaml", "-o", folder / device, "--device", device, "--quiet")
        with open_run(folder / device) as run:
            seconds[device] = math.fsum(run["solves/seconds"][:])
    with open_run(folder / "cuda") as run:
        off = plane_wave_errors(run, SPHERE_KA / K, ["fixed"])["fixed"]
        return row("a sphere, one drive", len(run["mesh/area"]), seconds["cuda"], seconds["cpu"], off)


def sweep(folder):
    cases = {}
    for device, heights in (("cpu", HEIGHTS[:3]), ("cuda", HEIGHTS)):
        scene = folder / f"{device}.yaml"
        scene.write_text(f"base: {ROOT / 'scenes/width_8mm.yaml'}\nname: heights\n"
                         f"set: {{solve.methods: [surface], field: [], write: [h5], solve.device: {device}}}\n"
                         f"grid: {{'body.place.at_mm[2]': {heights}}}\n")
        whole = touchfield(device, "sweep", scene, "-o", folder / device, "--jobs", "1")
        cases[device] = table(folder / device / "sweep.csv")
    times = [float(case["seconds"]) for case in cases["cpu"]]
    processor = times[0] + (len(HEIGHTS) - 1) * sum(times[1:]) / len(times[1:])
    off = max(abs(float(a["relative_error"]) - float(b["relative_error"])) for a, b in zip(cases["cpu"], cases["cuda"]))
    return row("heights of scenes/width_8mm.yaml", cases["cuda"][0]["faces"], whole, processor, 100 * off)


tables = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "results/tables")
rows = []
for measure in (sphere, sweep):
    with tempfile.TemporaryDirectory() as place:
        rows.append(measure(pathlib.Path(place)))
    print(*rows[-1].values(), flush=True)
write_table(tables / "gpu_runs.csv", rows, made_by("scripts/gpu_runs.py", PROGRAM))
