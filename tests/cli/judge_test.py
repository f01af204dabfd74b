"""A judge with a model of its own: what lands in /judge, and that it is what the metrics say."""

import json
import math
import unittest

import numpy

from meshes import icosphere, write_ply
from sphere_series import K
from support import FINGER, CommandTest, faces, open_run, relative_l2

OWN_METHODS = "[paper, unscattered, focus, {fixed: {phases_rad: 0}}]"
NAMES = ["paper", "unscattered", "focus", "fixed"]

SPHERE = """\
name: sphere
array: {plane_wave: {}}
body: {mesh: {file: sphere.ply, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0}}], alarm: never}
judge: none
write: [h5]
"""


class Judge(CommandTest):
    def check_metrics(self, run, name):
        """relative_error and leakage anew, from the judge's pressure on the judge's mesh."""
        area, target = run["judge/mesh/area"][:], run["judge/target/face"][:]
        wanted = numpy.zeros_like(area)
        wanted[target] = run["judge/target/amplitude"][:]
        p = numpy.abs(run[f"judge/methods/{name}/pressure"][:])
        scale = numpy.sum(area * p * wanted) / numpy.sum(area * p**2)
        metrics = run[f"methods/{name}"].attrs
        self.assertAlmostEqual(metrics["relative_error"], relative_l2(area, scale * p, wanted), places=10)
        energy = area * p**2
        self.assertAlmostEqual(metrics["leakage"], 1 - energy[target].sum() / energy.sum(), places=10)
        self.assertAlmostEqual(metrics["peak_pa"], p.max(), delta=1e-9 * p.max())

    def check_own_mesh(self, run, judge):
        """The groups, their sizes and what they say; returns judge_difference of each method."""
        self.assertEqual(run["judge"].attrs["judge"], judge)
        self.assertEqual(run["judge"].attrs["scheme"], "burton_miller_polished")
        count, = run["judge/mesh/area"].shape
        self.assertEqual(run["judge/mesh/triangles"].shape, (count, 3))
        vertices = run["judge/mesh/vertices"][:]
        self.assertEqual(len(vertices), count // 2 + 2)  # Euler: closed, no handle
        self.assertEqual(run["judge/mesh/triangles"][:].max(), len(vertices) - 1)
        self.assertEqual(run["judge/target/face"].shape, run["judge/target/amplitude"].shape)
        numpy.testing.assert_array_equal(run["judge/target/amplitude"][:], 500)
        self.assertGreater(len(run["judge/target/face"]), len(run["target/face"]))
        self.assertEqual(sorted(run["judge/methods"]), sorted(NAMES))
        for name in NAMES:
            self.assertEqual(run[f"judge/methods/{name}/pressure"].shape, (count,))
            self.check_metrics(run, name)
        self.assertIn("judge", [stage.decode() for stage in run["solves/stage"][:]])
        return {name: run[f"methods/{name}"].attrs["judge_difference"] for name in NAMES}

    def test_a_mesh_of_its_own(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "split", "--set", "judge={scheme: burton_miller_polished, split: 1}")
        self.run_ok("run", scene, "-o", "edge", "--set", "judge={scheme: burton_miller_polished, edge_mm: 1.3}")
        self.assertTrue((self.folder / "split/judge.vtp").exists())
        with open_run(self.folder / "split") as run:
            by_split = self.check_own_mesh(run, "split")
            area = run["mesh/area"][:]
            self.assertEqual(run["judge/mesh/area"].shape, (4 * len(area),))
            # What judge_difference is: face f's middle child is 4f + 3.
            own, _ = faces(run)
            corners = run["judge/mesh/vertices"][:][run["judge/mesh/triangles"][:]]
            numpy.testing.assert_allclose(corners.mean(axis=1)[3::4], own, atol=1e-12)
            for name in NAMES:
                judged = run[f"judge/methods/{name}/pressure"][:][3::4]
                difference = relative_l2(area, run[f"methods/{name}/pressure"][:], judged)
                self.assertAlmostEqual(by_split[name], difference, places=10)
        with open_run(self.folder / "edge") as run:
            by_edge = self.check_own_mesh(run, "edge")
            corners = run["judge/mesh/vertices"][:][run["judge/mesh/triangles"][:]]
            mean_edge = numpy.linalg.norm(corners - numpy.roll(corners, 1, axis=1), axis=2).mean()
            self.assertAlmostEqual(mean_edge, 1.3e-3, delta=0.15e-3)
        for name in NAMES:
            print(f"{name}: judge_difference {100 * by_split[name]:.2f} % (split), {100 * by_edge[name]:.2f} % (edge)")
            for difference in [by_split[name], by_edge[name]]:
                self.assertTrue(0 < difference < 0.05, difference)
            # Not equal: a mesh made anew follows the round surface, a split one the flat faces.
            self.assertTrue(1 / 3 < by_split[name] / by_edge[name] < 3)

    def test_a_judge_is_where_another_split_would_hardly_move_it(self):
        # ka 3.3: 6.3 edges a wavelength before any split.
        write_ply(self.folder / "sphere.ply", *icosphere(2, 3.3 / K * 1e3))
        scene = self.write("sphere.yaml", SPHERE)
        pressures, areas = [], []
        for splits in [1, 2]:
            self.run_ok("run", scene, "-o", f"split{splits}", "--set", f"judge={{split: {splits}}}")
            with open_run(self.folder / f"split{splits}") as run:
                pressures.append(run["judge/methods/fixed/pressure"][:])
                areas.append(run["judge/mesh/area"][:])
        self.assertEqual(len(pressures[1]), 4 * len(pressures[0]))
        difference = relative_l2(areas[0], pressures[0], pressures[1][3::4])
        print(f"one split against two: {100 * difference:.2f} %")
        self.assertLess(difference, 0.01)

    def test_the_same_judge_for_methods_of_another_scheme(self):
        methods = """
    - {paper: {as: published, scheme: paper}}
    - focus
    - {fixed: {as: plain, scheme: paper_corrected, phases_rad: 0}}"""
        scene = self.write("scene.yaml", FINGER.replace(OWN_METHODS, methods))
        self.run_ok("run", scene, "-o", "out")
        self.run_ok("run", scene, "-o", "alike", "--set", "solve.methods=[{fixed: {as: plain, phases_rad: 0}}]")
        with open_run(self.folder / "out") as run, open_run(self.folder / "alike") as alike:
            area = run["mesh/area"][:]
            self.assertEqual(run["judge"].attrs["judge"], "same")
            for name in ["published", "plain"]:
                own, judged = run[f"methods/{name}/pressure"][:], run[f"judge/methods/{name}/pressure"][:]
                difference = run[f"methods/{name}"].attrs["judge_difference"]
                self.assertAlmostEqual(difference, relative_l2(area, own, judged), places=10)
                self.assertGreater(difference, 0.005)
                self.check_metrics(run, name)
            # The judge is solve.scheme's: what a method of that scheme finds for the same phases, to the tolerance.
            judged, expected = run["judge/methods/plain/pressure"][:], alike["methods/plain/pressure"][:]
            self.assertLess(relative_l2(area, judged, expected), 1e-3)
            numpy.testing.assert_array_equal(run["judge/methods/focus/pressure"][:], run["methods/focus/pressure"][:])
            self.assertTrue(math.isnan(run["methods/focus"].attrs["judge_difference"]))

    def test_none_judges_nothing(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "out", "--set", "judge=none")
        with open_run(self.folder / "out") as run:
            self.assertNotIn("judge", run)
            self.assertTrue(math.isnan(run["methods/paper"].attrs["judge_difference"]))
            self.assertGreater(run["methods/paper"].attrs["relative_error"], 0)

    def test_the_metrics_printed_are_the_judges(self):
        scene = self.write("scene.yaml", FINGER)
        printed = json.loads(self.run_ok("run", scene, "-o", "out", "--json", "--set", "judge={split: 1}").stdout)
        with open_run(self.folder / "out") as run:
            for method in printed["methods"]:
                self.assertEqual(method["judge_difference"], run[f"methods/{method['name']}"].attrs["judge_difference"])
                self.check_metrics(run, method["name"])

    def test_another_edge_for_a_body_from_a_file(self):
        write_ply(self.folder / "sphere.ply", *icosphere(2, 5))
        scene = self.write("sphere.yaml", SPHERE.replace("judge: none", "judge: {edge_mm: 1}"))
        self.run_ok("run", scene, "-o", "out")
        with open_run(self.folder / "out") as run:
            area = run["judge/mesh/area"][:]
            self.assertAlmostEqual(numpy.sqrt(4 / numpy.sqrt(3) * area.mean()), 1e-3, delta=0.06e-3)
            # The file's own flat faces, meshed anew: its area, but for what rounding its blunt edges takes.
            self.assertAlmostEqual(area.sum(), run["mesh/area"][:].sum(), delta=0.01 * area.sum())


if __name__ == "__main__":
    unittest.main()
