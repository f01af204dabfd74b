"""scripts/numcalc: what it writes for NumCalc and reads of it, with a stand-in that solves nothing; NumCalc itself if NUMCALC names it.

The stand-in answers with the incident wave at the faces' centroids, which the test knows from run.h5.
"""

import csv
import math
import os
import subprocess
import unittest

import numpy

from support import SOURCE, CommandTest, faces, open_run

SCENE = """\
name: ball
medium: {temperature_c: 10}
frequency_khz: 30
array: {ARRAY}
body: {sphere: {radius_mm: 6}, edge_mm: 2.5}
solve: {methods: [{fixed: {as: rest, phases_rad: 0}}, {fixed: {as: turned, phases_rad: 1.3}}], resonance_check: never}
evaluation: {split: 1}
write: [h5]
"""
POINTS = "{positions: {points_mm: [[0, 5, -60], [30, 0, -50]]}, directivity: omni, level: 0.5}"
PLANE = "{plane_wave: {direction: [0, 3, 4], amplitude_pa: 2}}"

STAND_IN = r'''#!/usr/bin/python3
import pathlib, sys, numpy
lines = [line for line in pathlib.Path("NC.inp").read_text().splitlines() if not line.startswith("#")]
assert lines[0].startswith("Mesh2HRTF"), lines[0]
step = float(lines[3].split()[2])
count = int(lines[4].split()[1])
curve = [list(map(float, line.split())) for line in lines[5:5 + count]]
frequency, = [row[1] for row in curve if row[0] == step]
main1, main2, _, main4 = [line.split() for line in lines[5 + count:9 + count]]
k = 2 * numpy.pi * frequency / float(main4[0])
assert float(main4[2]) == 1.0, "the time factor is not exp(-i omega t)"
rest = lines[9 + count:]
assert rest[0] == "NODES" and rest[2] == "ELEMENTS" and rest[4:6] == ["BOUNDARY", "RETU"], rest
def table(name):
    rows = pathlib.Path(name).read_text().splitlines()
    assert int(rows[0]) == len(rows) - 1
    return [row.split() for row in rows[1:]]
node = {row[0]: list(map(float, row[1:])) for row in table(rest[1])}
elements = table(rest[3])
assert len(elements) == int(main1[1]) and len(node) == int(main1[2])
assert all(len(row) == 7 and row[4:] == ["0", "0", "0"] for row in elements)
x = numpy.array([[node[c] for c in row[1:4]] for row in elements]).mean(axis=1)
p = numpy.zeros(len(x), complex)
plane = rest[6] == "PLANE WAVES"
assert plane or rest[6] == "POINT SOURCES"
sources = [row.split() for row in rest[7:rest.index("POST PROCESS")]]
assert [len(sources) if plane else 0, 0 if plane else len(sources)] == list(map(int, main2[:2]))
for row in sources:
    assert len(row) == 8 and row[5] == row[7] == "-1"
    place, strength = numpy.array(row[1:4], float), complex(float(row[4]), float(row[6]))
    r = numpy.linalg.norm(x - place, axis=1)
    p += strength * (numpy.exp(1j * k * (x @ place)) if plane else numpy.exp(1j * k * r) / (4 * numpy.pi * r))
out = pathlib.Path("be.out/be.1")
out.mkdir(parents=True)
rows = [f"{row[0]:>5} {v.real: E} {v.imag: E}" for row, v in zip(elements, p)]
(out / "pBoundary").write_text("\n".join(["Mesh2HRTF 1.0.0", "    1", f"    0 {len(x)}", *reversed(rows)]) + "\n")
'''


class NumCalc(CommandTest):
    def executable(self, text):
        path = self.write("stand-in", text)
        path.chmod(0o755)
        return path

    def compare(self, program, *arguments):
        return subprocess.run([SOURCE / "scripts/numcalc", "run", program, *arguments], cwd=self.folder, text=True, capture_output=True, check=False)

    def row(self, program, *arguments):
        done = self.compare(program, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        row, = csv.DictReader(done.stdout.splitlines())
        return row

    def solve(self, array, *arguments):
        scene = self.write("scene.yaml", SCENE.replace("{ARRAY}", array))
        self.run_ok("run", scene, "-o", "run", "--quiet", *arguments)

    def incident(self, run, method, centroid):
        k = 2 * math.pi * 30e3 / (343.21 * math.sqrt(283.15 / 293.15))
        drive = run["array/amplitude"][:] * numpy.exp(1j * run[f"methods/{method}/phase"][:]) * run[f"methods/{method}/amplitude"][:]
        if run["array"].attrs["kind"] == "plane_wave":
            return drive[0] * numpy.exp(1j * k * centroid @ run["array/axis"][0])
        r = numpy.linalg.norm(centroid[:, None] - run["array/position"][:][None], axis=2)
        return (numpy.exp(1j * k * r) / r) @ drive

    def check(self, method):
        row = self.row(self.executable(STAND_IN), "--method", method)
        with open_run(self.folder / "run") as run:
            centroid, area = faces(run)
            own = run[f"methods/{method}/pressure"][:]
            other = self.incident(run, method, centroid)
            fine = run["evaluation/mesh/vertices"][:][run["evaluation/mesh/triangles"][:]].mean(axis=1)
            near = numpy.array([numpy.linalg.norm(fine - x, axis=1).argmin() for x in centroid])
            own_fine = run[f"evaluation/methods/{method}/pressure"][:][near]

        def apart(a, b):
            return math.sqrt(numpy.sum(area * abs(a - b)**2) / numpy.sum(area * abs(own)**2))
        self.assertEqual(int(row["faces"]), len(area))
        self.assertGreater(apart(own, other), 0.1)  # it is not the solution
        self.assertAlmostEqual(float(row["difference"]) / apart(own, other), 1, delta=1e-4)
        self.assertAlmostEqual(float(row["error_touchfield"]) / apart(own, own_fine), 1, delta=1e-4)
        self.assertLess(float(row["error_numcalc"]), 1e-4)  # the middle faces are where the faces are
        self.assertAlmostEqual(float(row["difference_finer"]) / apart(own_fine, other), 1, delta=1e-4)
        self.assertEqual(row["holds"], "0")

    def test_sources(self):
        for array, method in ((POINTS, "turned"), (PLANE, "rest")):
            with self.subTest(method):
                self.solve(array, "--force")
                self.check(method)

    def test_what_is_refused(self):
        for array, program, says in ((POINTS, "#!/bin/sh\necho no licence\nexit 3\n", "ended with 3:\nno licence"),
                                     (POINTS, STAND_IN.replace("reversed(rows)", "rows[:-1]"), "not one finite pressure a face"),
                                     (POINTS.replace("omni", "piston"), STAND_IN, "--set array.directivity=omni")):
            self.solve(array, "--force")
            done = self.compare(self.executable(program))
            self.assertEqual(done.returncode, 1)
            self.assertIn(says, done.stderr)

    def test_numcalc_itself(self):
        if not os.environ.get("NUMCALC"):
            self.skipTest("NUMCALC names no program")
        self.solve(POINTS)
        self.assertEqual(self.row(os.environ["NUMCALC"])["holds"], "1")


if __name__ == "__main__":
    unittest.main()
