"""Every phase method on one finger: the cost on the skin, recomputed from run.h5, and the bound that holds for all."""

import unittest

import h5py
import numpy

from support import FINGER, CommandTest

METHODS = ["surface", "paper", "unscattered", "focus", "gs", "wgs", "gs_pat", "eigen", "lbfgs", "fixed"]
LISTED = ("[{surface: {start: {random: 3, restarts: 2}}}, paper, unscattered, focus, gs, wgs, gs_pat, eigen, "
          "{lbfgs: {iterations: 200}}, {fixed: {phases_rad: 0}}]")


class Methods(CommandTest):
    def scene(self, pressure, methods=LISTED, more=""):
        text = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", methods).replace(
            "pressure_pa: 500", f"pressure_pa: {pressure}").replace("write: [h5, vtp, vti]", "write: [h5]").replace(
            "iterations: 8", "iterations: 40" + more)
        return self.write("scene.yaml", text)

    def test_costs_and_the_bound(self):
        for pressure in (300, 1500):  # less than the array can, and about all of it
            scene = self.scene(pressure, more="\n  certificate: true")
            said = self.run_ok("run", scene, "-o", f"at_{pressure}")
            self.assertIn(" gap ", said.stdout.splitlines()[0])
            with h5py.File(self.folder / f"at_{pressure}" / "run.h5") as run:
                self.assertEqual(sorted(run["methods"]), sorted(METHODS))
                cost = {name: self.check_cost(run, name) for name in METHODS}
                bounds = {run[f"methods/{name}"].attrs["cost_bound"] for name in METHODS}
                self.assertEqual(len(bounds), 1)
                bound = bounds.pop()
                for name in METHODS:
                    self.assertLess(bound, cost[name], name)
                    self.assertAlmostEqual(run[f"methods/{name}"].attrs["optimality_gap"], cost[name] / bound - 1)
            self.assertLess(cost["surface"], 1.1 * bound)
            self.assertEqual(min(cost, key=cost.get) in ("surface", "lbfgs"), True, cost)
            self.assertLess(cost["surface"], 1.02 * cost["lbfgs"])
            for name in ("paper", "unscattered", "gs", "eigen", "fixed"):
                self.assertLess(cost["surface"], cost[name], name)

    def check_cost(self, run, name):
        """surface's cost at the method's best level up to 1, from its pressure alone."""
        area = run["mesh/area"][:]
        wanted = numpy.zeros(len(area))
        wanted[run["target/face"][:]] = run["target/amplitude"][:]
        p = numpy.abs(run[f"methods/{name}/pressure"][:])
        level = min(1, (area * p * wanted).sum() / (area * p**2).sum())
        cost = (area * (level * p - wanted) ** 2).sum()
        stored = run[f"methods/{name}"].attrs["cost_skin"]
        self.assertAlmostEqual(stored / cost, 1, delta=2e-3, msg=name)  # what the quiet rows leave out, and the solver
        return stored

    def test_amplitudes_and_ranges(self):
        self.run_ok("run", self.scene(300, "[{surface: {as: free, free_amplitudes: true}}, surface, gs_pat, wgs]"),
                    "-o", "out")
        with h5py.File(self.folder / "out" / "run.h5") as run:
            for name, method in run["methods"].items():
                phase, amplitude = method["phase"][:], method["amplitude"][:]
                self.assertTrue(((0 <= phase) & (phase < 2 * numpy.pi)).all(), name)
                if name == "free":
                    self.assertTrue(((0 <= amplitude) & (amplitude <= 1)).all())
                    self.assertLess(amplitude.min(), 0.9)
                else:
                    self.assertTrue((amplitude == 1).all())
            self.assertLess(run["methods/free"].attrs["cost"], run["methods/surface"].attrs["cost"])
            self.assertTrue((numpy.diff(run["methods/surface/cost"][:]) <= 0).all())  # never an increase

    def test_the_same_seed_gives_the_same_phases(self):
        phases = []
        for out, seed in (("a", 3), ("b", 3), ("c", 4)):
            scene = self.scene(1500, f"[{{surface: {{start: {{random: {seed}}}}}}}]")
            self.run_ok("run", scene, "-o", out)
            with h5py.File(self.folder / out / "run.h5") as run:
                phases.append(run["methods/surface/phase"][:])
        numpy.testing.assert_allclose(phases[0], phases[1], atol=1e-6)
        self.assertGreater(numpy.abs(phases[0] - phases[2]).max(), 0.1)

    def test_a_warm_start_goes_on(self):
        self.run_ok("run", self.scene(1500, "[surface]"), "-o", "first")
        self.run_ok("run", self.scene(1500, "[{surface: {iterations: 3, start: {previous: first/run.h5}}}]"), "-o",
                    "second")
        with h5py.File(self.folder / "first" / "run.h5") as first, h5py.File(self.folder / "second" / "run.h5") as second:
            end = first["methods/surface/cost"][-1]
            self.assertAlmostEqual(second["methods/surface/cost"][0] / end, 1, places=6)
            self.assertLessEqual(second["methods/surface/cost"][-1], end * (1 + 1e-9))


if __name__ == "__main__":
    unittest.main()
