"""A rigid prolate spheroid of 32 x 16 mm in a plane wave along its axis, against tests/data/spheroid/axial.csv."""

import math
import unittest

import numpy

from meshes import icosphere, volume, write_ply
from support import SOURCE, CommandTest, faces, open_run, relative_l2

LONG, SHORT = 16.0, 8.0  # semi-axes [mm]
SCENE = """\
name: spheroid
array: {plane_wave: {direction: [0, 0, 1]}}
body: {mesh: {file: spheroid.ply, unit: mm}}
solve: {methods: [{fixed: {as: paper, scheme: paper, phases_rad: 0}}, {fixed: {as: polished, phases_rad: 0}}], alarm: never}
write: [h5]
"""


class Spheroid(CommandTest):
    def errors(self, splits):
        vertices, triangles = icosphere(splits, 1.0)
        vertices = vertices * [SHORT, SHORT, LONG]
        vertices *= (4 / 3 * math.pi * LONG * SHORT**2 / volume(vertices, triangles)) ** (1 / 3)
        write_ply(self.folder / "spheroid.ply", vertices, triangles)
        self.run_ok("run", self.write("spheroid.yaml", SCENE), "-o", "out", "--force", "--quiet")
        height, real, imaginary = numpy.loadtxt(SOURCE / "tests/data/spheroid/axial.csv", delimiter=",", skiprows=2).T
        with open_run(self.folder / "out") as run:
            centroid, area = faces(run)
            pressures = [run[f"methods/{name}/pressure"][:] for name in ["paper", "polished"]]
        # The point of the spheroid above a face, by its parameter.
        at = 1e3 * centroid / [SHORT, SHORT, LONG]
        at = at[:, 2] / numpy.linalg.norm(at, axis=1)
        exact = numpy.interp(at, height, real) + 1j * numpy.interp(at, height, imaginary)
        found = [relative_l2(area, p, exact) for p in pressures]
        print(f"{len(area)} faces: paper {100 * found[0]:.2f} %, polished {100 * found[1]:.2f} %")
        return found

    def test_default_scheme_converges_to_it(self):
        _, coarse = self.errors(3)  # 1,280 faces, 4.9 edges a wavelength
        paper, fine = self.errors(4)
        self.assertLess(coarse, 0.02)
        self.assertLess(fine, 0.006)
        self.assertGreater(math.log2(coarse / fine), 1.0)
        self.assertLess(math.log2(coarse / fine), 2.5)
        self.assertGreater(paper, 2 * fine)


if __name__ == "__main__":
    unittest.main()
