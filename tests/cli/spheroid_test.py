"""A rigid prolate spheroid of 32 x 16 mm in a plane wave along its axis, against tests/data/spheroid/axial.csv."""

import math
import unittest

import numpy

from meshes import icosphere, volume, write_ply
from support import SOURCE, CommandTest, faces, open_run, relative_l2

LONG, SHORT = 16.0, 8.0  # semi-axes [mm]
SCHEMES = ["paper", "paper_corrected", "burton_miller", "burton_miller_polished"]
SCENE = """\
name: spheroid
array: {plane_wave: {direction: [0, 0, 1]}}
body: {mesh: {file: spheroid.ply, unit: mm}, edge_mm: EDGE}
solve: {methods: [METHODS], resonance_check: never}
write: [h5]
""".replace("METHODS", ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in SCHEMES))


class Spheroid(CommandTest):
    def errors(self, splits, edge=None):
        """Of each scheme on an icosahedron split so often and stretched twofold, or that meshed anew with this edge [mm]."""
        vertices, triangles = icosphere(splits, 1.0)
        vertices = vertices * [SHORT, SHORT, LONG]
        vertices *= (4 / 3 * math.pi * LONG * SHORT**2 / volume(vertices, triangles)) ** (1 / 3)
        write_ply(self.folder / "spheroid.ply", vertices, triangles)
        text = SCENE.replace("EDGE", str(edge)) if edge else SCENE.replace(", edge_mm: EDGE", "")
        self.run_ok("run", self.write("spheroid.yaml", text), "-o", "out", "--force", "--quiet")
        height, real, imaginary = numpy.loadtxt(SOURCE / "tests/data/spheroid/axial.csv", delimiter=",", skiprows=2).T
        with open_run(self.folder / "out") as run:
            centroid, area = faces(run)
            pressures = [run[f"methods/{scheme}/pressure"][:] for scheme in SCHEMES]
        # The point of the spheroid above a face, by its parameter.
        at = 1e3 * centroid / [SHORT, SHORT, LONG]
        at = at[:, 2] / numpy.linalg.norm(at, axis=1)
        exact = numpy.interp(at, height, real) + 1j * numpy.interp(at, height, imaginary)
        found = dict(zip(SCHEMES, (relative_l2(area, p, exact) for p in pressures)))
        print(f"{'even' if edge else 'stretched'},{len(area)}," + ",".join(f"{error:.4f}" for error in found.values()), flush=True)
        return found

    def assert_order(self, coarse, fine, ratio, least, most):
        order = math.log(coarse / fine) / math.log(ratio)
        self.assertGreater(order, least)
        self.assertLess(order, most)

    def test_even_faces(self):
        coarse, fine = self.errors(5, 1.8), self.errors(5, 1.2)  # 4.7 and 7.1 edges a wavelength
        self.assertLess(coarse["burton_miller_polished"], 0.018)
        self.assertLess(fine["burton_miller_polished"], 0.010)
        self.assert_order(coarse["burton_miller_polished"], fine["burton_miller_polished"], 1.5, 1.0, 2.3)
        self.assertGreater(fine["paper"], 5 * fine["burton_miller_polished"])

    def test_stretched_faces(self):
        # The hypersingular integral of a constant pressure a face, at centroids that lie in no even pattern, is of first
        # order; the plain equation keeps its second.
        coarse, fine = self.errors(3), self.errors(4)
        self.assert_order(coarse["paper_corrected"], fine["paper_corrected"], 2, 1.7, 2.5)
        self.assert_order(coarse["burton_miller"], fine["burton_miller"], 2, 0.7, 1.5)
        self.assertLess(fine["burton_miller_polished"], 0.010)


if __name__ == "__main__":
    unittest.main()
