"""An evaluation with a model of its own: what lands in /evaluation, and that it is what the metrics say."""

import math
import unittest

import numpy

from support import FINGER, CommandTest, faces, open_run, relative_l2

OWN_METHODS = "[paper, unscattered, focus, {fixed: {phases_rad: 0}}]"
NAMES = ["paper", "unscattered", "focus", "fixed"]


class Evaluation(CommandTest):
    def check_metrics(self, run, name):
        """relative_error and leakage anew, from the evaluation's pressure on the evaluation mesh."""
        area, target = run["evaluation/mesh/area"][:], run["evaluation/target/face"][:]
        inside, wanted = area[target] * run["evaluation/target/share"][:], run["evaluation/target/amplitude"][:]
        p = numpy.abs(run[f"evaluation/methods/{name}/pressure"][:])
        metrics = run[f"methods/{name}"].attrs
        energy, product = numpy.sum(area * p**2), numpy.sum(inside * p[target] * wanted)
        self.assertAlmostEqual(metrics["relative_error"], numpy.sqrt(1 - product**2 / energy / numpy.sum(inside * wanted**2)), places=10)
        self.assertAlmostEqual(metrics["leakage"], 1 - numpy.sum(inside * p[target] ** 2) / energy, places=10)
        self.assertAlmostEqual(metrics["peak_pa"], p.max(), delta=1e-9 * p.max())

    def check_own_mesh(self, run, evaluation):
        """The groups, their sizes and what they say; returns evaluation_difference of each method."""
        self.assertEqual(run["evaluation"].attrs["evaluation"], evaluation)
        self.assertEqual(run["evaluation"].attrs["scheme"], "burton_miller_polished")
        count, = run["evaluation/mesh/area"].shape
        self.assertEqual(len(run["evaluation/mesh/vertices"]), count // 2 + 2)  # Euler: closed, no handle
        numpy.testing.assert_array_equal(run["evaluation/target/amplitude"][:], 500)
        self.assertGreater(len(run["evaluation/target/face"]), len(run["target/face"]))
        self.assertEqual(sorted(run["evaluation/methods"]), sorted(NAMES))
        for name in NAMES:
            self.assertEqual(run[f"evaluation/methods/{name}/pressure"].shape, (count,))
            self.check_metrics(run, name)
        self.assertIn("evaluation", [stage.decode() for stage in run["solves/stage"][:]])
        return {name: run[f"methods/{name}"].attrs["evaluation_difference"] for name in NAMES}

    def test_a_mesh_of_its_own(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "split", "--set", "evaluation={scheme: burton_miller_polished, split: 1}")
        self.run_ok("run", scene, "-o", "edge", "--set", "evaluation={scheme: burton_miller_polished, edge_mm: 1.3}")
        self.assertTrue((self.folder / "split/evaluation.vtp").exists())
        with open_run(self.folder / "split") as run:
            by_split = self.check_own_mesh(run, "split")
            area = run["mesh/area"][:]
            self.assertEqual(run["evaluation/mesh/area"].shape, (4 * len(area),))
            # What evaluation_difference is: face f's middle child is 4f + 3.
            own, _ = faces(run)
            corners = run["evaluation/mesh/vertices"][:][run["evaluation/mesh/triangles"][:]]
            numpy.testing.assert_allclose(corners.mean(axis=1)[3::4], own, atol=1e-12)
            for name in NAMES:
                evaluated = run[f"evaluation/methods/{name}/pressure"][:][3::4]
                difference = relative_l2(area, run[f"methods/{name}/pressure"][:], evaluated)
                self.assertAlmostEqual(by_split[name], difference, places=10)
        with open_run(self.folder / "edge") as run:
            by_edge = self.check_own_mesh(run, "edge")
            corners = run["evaluation/mesh/vertices"][:][run["evaluation/mesh/triangles"][:]]
            mean_edge = numpy.linalg.norm(corners - numpy.roll(corners, 1, axis=1), axis=2).mean()
            self.assertAlmostEqual(mean_edge, 1.3e-3, delta=0.15e-3)
        for name in NAMES:  # a mesh made anew follows the round surface, a split one the flat faces
            self.assertTrue(0 < by_split[name] < 0.05 and 1 / 3 < by_split[name] / by_edge[name] < 3, name)

    def test_the_same_evaluation_for_methods_of_another_scheme(self):
        methods = """
    - {paper: {as: published, scheme: paper}}
    - focus
    - {fixed: {as: plain, scheme: paper_corrected, phases_rad: 0}}"""
        scene = self.write("scene.yaml", FINGER.replace(OWN_METHODS, methods))
        self.run_ok("run", scene, "-o", "out")
        self.run_ok("run", scene, "-o", "alike", "--set", "solve.methods=[{fixed: {as: plain, phases_rad: 0}}]")
        with open_run(self.folder / "out") as run, open_run(self.folder / "alike") as alike:
            area = run["mesh/area"][:]
            self.assertEqual(run["evaluation"].attrs["evaluation"], "same")
            for name in ["published", "plain"]:
                own, evaluated = run[f"methods/{name}/pressure"][:], run[f"evaluation/methods/{name}/pressure"][:]
                difference = run[f"methods/{name}"].attrs["evaluation_difference"]
                self.assertAlmostEqual(difference, relative_l2(area, own, evaluated), places=10)
                self.assertGreater(difference, 0.005)
                self.check_metrics(run, name)
            # The evaluation is solve.scheme's: what a method of that scheme finds for the same phases, to the tolerance.
            evaluated, expected = run["evaluation/methods/plain/pressure"][:], alike["methods/plain/pressure"][:]
            self.assertLess(relative_l2(area, evaluated, expected), 1e-3)
            numpy.testing.assert_array_equal(run["evaluation/methods/focus/pressure"][:], run["methods/focus/pressure"][:])
            self.assertTrue(math.isnan(run["methods/focus"].attrs["evaluation_difference"]))


if __name__ == "__main__":
    unittest.main()
