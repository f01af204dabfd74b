"""How B p = b is solved, through the command line: every solver and precision comes to the same pressure."""

import json
import math
import unittest

from support import FINGER, CommandTest, open_run, relative_l2, warning_names

SCENE = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[{fixed: {phases_rad: 0}}]").replace(
    "write: [h5, vtp, vti]", "  resonance_check: never\nevaluation: none\nwrite: [h5]")
CALLED = {"lu": "LU", "gmres": "GMRES, stored", "matrix_free": "GMRES, matrix-free", "fft": "GMRES, FFT"}


class Solver(CommandTest):
    def solve(self, **options):
        """The pressure, the areas, and /solves as a map of columns."""
        scene = self.write("scene.yaml", SCENE)
        sets = [argument for key, value in options.items() for argument in ("--set", f"solve.{key}={value}")]
        self.last = self.run_ok("run", scene, "-o", "out", "--force", "--quiet", *sets)
        with open_run(self.folder / "out") as run:
            columns = {name: column.asstr()[:] if column.dtype == object else column[:]
                       for name, column in run["solves"].items()}
            self.resonance_check = run.attrs["resonance_check"]
            return run["methods/fixed/pressure"][:], run["mesh/area"][:], columns

    def test_all_come_to_the_same(self):
        expected, area, _ = self.solve(solver="lu", precision="double", tolerance=1e-12)
        for solver, called in CALLED.items():
            for precision in ["double", "single"]:
                p, _, solves = self.solve(solver=solver, precision=precision, tolerance=1e-6)
                self.assertEqual(list(solves["solver"]), [called])
                self.assertEqual(list(solves["precision"]), [precision.replace("single", "single refined")])
                self.assertEqual(list(solves["converged"]), [1])
                self.assertLessEqual(solves["residual"][0], 1e-6)
                self.assertEqual(solves["steps"][0] == 0, solver == "lu")
                # B is well conditioned here: an error is little larger than its residual.
                self.assertLess(relative_l2(area, p, expected), 5e-6, f"{solver}, {precision}")

    def test_refinement_reaches_what_single_precision_cannot(self):
        _, _, plain = self.solve(solver="matrix_free", precision="single", tolerance=1e-10, refine="false", max_steps=60)
        _, _, refined = self.solve(solver="matrix_free", precision="single", tolerance=1e-10)
        self.assertGreater(plain["residual"][0], 1e-8)
        self.assertEqual((plain["refinements"][0], plain["converged"][0], plain["precision"][0]), (0, 0, "single"))
        self.assertLessEqual(refined["residual"][0], 1e-10)
        self.assertGreaterEqual(refined["refinements"][0], 1)
        self.assertEqual(refined["converged"][0], 1)

    def test_too_few_steps_are_a_warning(self):
        _, _, solves = self.solve(max_steps=5)
        self.assertEqual((solves["steps"][0], solves["converged"][0]), (5, 0))
        self.assertGreater(solves["residual"][0], 1e-4)
        self.assertEqual(warning_names(self.last.stderr), ["not_converged"])
        with open_run(self.folder / "out") as run:
            self.assertEqual(run.attrs["complete"], 1)

    def test_a_system_that_is_not_solved_ends_a_run_before_phases(self):
        scene = self.write("scene.yaml", FINGER)
        one_step = ["--set", "solve.solver=gmres", "--set", "solve.max_steps=1", "--set", "solve.scheme=paper"]
        says = ["trial: scheme paper by GMRES, stored on", "after 1 steps", "use the scheme burton_miller_polished"]
        done = self.is_refused("run", scene, "-o", "out", *one_step, code=1, says=says)
        self.assertFalse((self.folder / "out/run.h5").exists())
        self.assertNotIn("  solve paper", done.stdout + done.stderr)
        # `check` tells, `study` measures it.
        said = json.loads(self.run_ok("check", scene, "--accuracy", "--json", *one_step).stdout)["warnings"]
        self.assertTrue(any(warning.startswith("broken_system: accuracy: scheme paper ") for warning in said), said)
        self.run_ok("study", scene, "-o", "study", "--edges-mm", "3.6", "--schemes", "paper", "--solvers", "gmres", *one_step)
        self.assertIn("not converged in 1 steps", (self.folder / "study/study.csv").read_text())

    def test_resonance_check(self):
        _, _, solves = self.solve(resonance_check="never")
        self.assertTrue(math.isnan(self.resonance_check))
        self.assertNotIn("resonance_check", solves["stage"])
        resonance_checks = {}
        for scheme, other in [("paper_corrected", "burton_miller"), ("chief", "burton_miller"),
                              ("burton_miller", "paper_corrected")]:
            _, _, solves = self.solve(scheme=scheme, resonance_check="always")
            self.assertEqual(list(solves["scheme"][solves["stage"] == "resonance_check"]), [other])
            resonance_checks[scheme] = self.resonance_check
        # The same two pressures, solved to 1e-3 and 1e-4.
        self.assertAlmostEqual(resonance_checks["paper_corrected"], resonance_checks["burton_miller"], delta=5e-3)
        for resonance_check in resonance_checks.values():
            self.assertTrue(0 < resonance_check < 0.1)


if __name__ == "__main__":
    unittest.main()
