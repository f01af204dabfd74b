"""Every phase method on one finger: the cost on the skin, recomputed from run.h5, and the bound that holds for all."""

import unittest

import h5py
import numpy

from support import FINGER, CommandTest

METHODS = ["surface", "radiation", "paper", "unscattered", "focus", "gs", "wgs", "gs_pat", "eigen", "lbfgs", "fixed"]
LISTED = ("[{surface: {start: {random: 3, restarts: 2}}}, radiation, paper, unscattered, focus, gs, wgs, gs_pat, eigen, "
          "{lbfgs: {iterations: 200}}, {fixed: {phases_rad: 0}}]")


class Methods(CommandTest):
    def scene(self, pressure, methods=LISTED, more=""):
        text = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", methods).replace(
            "pressure_pa: 500", f"pressure_pa: {pressure}").replace("write: [h5, vtp, vti]", "write: [h5]").replace(
            "iterations: 8", "iterations: 40" + more)
        return self.write("scene.yaml", text)

    def test_costs_and_the_bound(self):
        for pressure in (300, 1500):  # less than the array can, and about all of it
            scene = self.scene(pressure, more="\n  optimality_bound: true")
            said = self.run_ok("run", scene, "-o", f"at_{pressure}")
            self.assertIn("gap", said.stdout.splitlines()[0].split())
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
        face, share, wanted = (run[f"target/{part}"][:] for part in ("face", "share", "amplitude"))
        p = numpy.abs(run[f"methods/{name}/pressure"][:])
        inside = share * area[face]
        level = min(1, (inside * p[face] * wanted).sum() / (area * p**2).sum())
        off = inside * ((level * p[face] - wanted) ** 2 - (level * p[face]) ** 2)
        cost = off.sum() + (area * (level * p) ** 2).sum()
        stored = run[f"methods/{name}"].attrs["cost_skin"]
        self.assertAlmostEqual(stored / cost, 1, delta=2e-3, msg=name)  # what the outside rows leave out, and the solver
        return stored

    def moved(self, name, replacements):
        text = self.scene(500, "[{surface: {start: spectral, iterations: 300}}, paper, focus, gs, eigen]").read_text()
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new)
        scene = self.write(f"{name}.yaml", text)
        self.run_ok("run", scene, "-o", name)
        with h5py.File(self.folder / name / "run.h5") as run:
            return {key: numpy.abs(method["pressure"][:]) for key, method in run["methods"].items()}

    def test_a_rotated_scene_has_the_same_answer(self):
        """All of it by 90 degrees about x, then moved: (x, y, z) -> (x + 40, -z - 25, y + 300)."""
        here = self.moved("here", [])
        there = self.moved("there", [
            ("pitch_mm: 10.16}\n", "pitch_mm: 10.16}\n  at_mm: [40, -25, 300]\n  rotate_deg: [90, 0, 0]\n"),
            ("at_mm: [0, 0, 60]", "at_mm: [40, -85, 300], rotate_deg: [90, 0, 0]"),
            ("size_mm: [8, 12, 6]", "size_mm: [8, 6, 12]")])
        # Rounding of the coordinates, grown by the condition of B and by the steps: 2e-7 was seen. surface drops drives
        # below 1e-4 of what the array can do, and rounding moves where exactly that cut is: 2e-5.
        for name, pressure in here.items():
            self.assertLess(numpy.abs(there[name] - pressure).max() / pressure.max(), 1e-4 if name == "surface" else 1e-6, name)


if __name__ == "__main__":
    unittest.main()
