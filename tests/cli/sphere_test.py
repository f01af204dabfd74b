"""A rigid sphere through the command line and run.h5 alone, against the exact series."""

import math
import unittest

import numpy

from meshes import icosphere, write_ply, write_stl
from sphere_series import K, plane_wave, plane_wave_errors, point_source
from support import LONG, CommandTest, faces, open_run, relative_l2

SCENE = """\
name: sphere
array: {{plane_wave: {{direction: [0, 0, 1]}}}}
body: {{mesh: {{file: {mesh}, unit: mm}}}}
solve: {{methods: [{methods}], resonance_check: never{options}}}
evaluation: none
write: [h5]
"""


class Sphere(CommandTest):
    def errors(self, splits, ka, *schemes, options="", write=write_ply, ending="ply"):
        """Of each scheme on 20 x 4^splits faces, relative L2 of the complex pressure; and the most steps of GMRES."""
        mesh = self.folder / f"sphere.{ending}"
        write(mesh, *icosphere(splits, ka / K * 1e3))
        methods = ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in schemes)
        scene = self.write("sphere.yaml", SCENE.format(mesh=mesh.name, methods=methods,
                                                       options=options and f", {options}"))
        self.run_ok("run", scene, "-o", "sphere", "--force", "--quiet")
        with open_run(self.folder / "sphere") as run:
            self.assertEqual(len(run["mesh/area"]), 20 * 4**splits)
            self.assertTrue(numpy.all(run["solves/converged"][:] == 1))
            return plane_wave_errors(run, ka / K, schemes), int(run["solves/steps"][:].max())

    def test_series_is_the_reference(self):
        ends = numpy.array([1.0, 0.0, -1.0])
        numpy.testing.assert_allclose(point_source(8e-3, 0.2, ends), [
            -0.4793002 + 0.6217205j, -0.1965248 + 0.4628361j, 0.2300146 - 0.3534434j], atol=1e-6)
        numpy.testing.assert_allclose(plane_wave(8e-3, ends), [
            -1.129850 - 0.076383j, 1.290302 - 0.138109j, 1.819106 + 0.530108j], atol=1e-5)

    def test_point_source(self):
        scene = self.write("sphere.yaml", """\
name: sphere
array: {positions: {points_mm: [[0, 0, -200]]}, directivity: omni}
body: {sphere: {radius_mm: 8}, edge_mm: 0.8}
solve: {methods: [{fixed: {phases_rad: 0}}, {fixed: {as: published, scheme: paper, phases_rad: 0}}]}
write: [h5]
""")
        self.run_ok("run", scene, "-o", "out")
        with open_run(self.folder / "out") as run:
            centroid, area = faces(run)
            pressures = [run[f"methods/{name}/pressure"][:] for name in ["fixed", "published"]]
            self.assertEqual(run["array/position"].shape, (1, 3))
        cosine = -centroid[:, 2] / numpy.linalg.norm(centroid, axis=1)
        exact = 4 * math.pi * 4.386 * point_source(8e-3, 0.2, cosine)
        for p, limit in zip(pressures, [0.004, 0.06]):
            error, magnitude_error = relative_l2(area, p, exact), relative_l2(area, abs(p), abs(exact))
            self.assertLess(error, limit)
            self.assertLess(magnitude_error, limit)
        # The mesh is the sphere's in volume, so its area is a little larger than its face count makes it look.
        self.assertAlmostEqual(area.sum() / (4 * math.pi * 64e-6), 1.0, delta=0.005)

    def test_plane_wave_from_the_side_with_an_amplitude(self):
        radius = 5.1 / K * 1e3
        scene = self.write("wave.yaml", f"""\
name: wave
array: {{plane_wave: {{direction: [2, 0, 0], amplitude_pa: 3}}}}
body: {{sphere: {{radius_mm: {radius}}}, edge_mm: 1.0}}
solve: {{methods: [{{fixed: {{phases_rad: 0}}}}]}}
write: [h5]
""")
        self.run_ok("run", scene, "-o", "out")
        with open_run(self.folder / "out") as run:
            centroid, area = faces(run)
            p = run["methods/fixed/pressure"][:]
        cosine = centroid[:, 0] / numpy.linalg.norm(centroid, axis=1)
        self.assertLess(relative_l2(area, p, 3 * plane_wave(radius * 1e-3, cosine)), 0.007)

    @LONG
    def test_ka_25(self):
        found, steps = self.errors(5, 25, "burton_miller", "burton_miller_polished")
        self.assertLess(found["burton_miller"], 0.011)
        self.assertLess(found["burton_miller_polished"], 0.0045)
        self.assertLessEqual(steps, 20)

    @LONG
    def test_ka_25_in_few_steps(self):
        found, steps = self.errors(5, 25, "burton_miller", options="tolerance: 1e-3")
        self.assertLess(found["burton_miller"], 0.011)
        self.assertLessEqual(steps, 12)

    def test_stl_in_single_precision_gives_the_same(self):
        ply, stl = (self.errors(3, 5.1, "burton_miller_polished", **file)[0]["burton_miller_polished"]
                    for file in ({}, {"write": write_stl, "ending": "stl"}))
        self.assertLess(ply, 0.0055)
        self.assertAlmostEqual(stl, ply, delta=1e-5)


if __name__ == "__main__":
    unittest.main()
