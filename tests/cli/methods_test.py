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

    def test_phases_for_radiation_pressure(self):
        """Its cost face by face, from the pressures in run.h5 alone; and what `surface` presses beside it."""
        scene = self.scene(1500, "[{radiation: {outside_weight: 0.3}}, surface]")
        self.run_ok("run", scene, "-o", "out", "--set", "evaluation=same")
        with h5py.File(self.folder / "out" / "run.h5") as run:
            area, face, inside, wanted = (run[name][:] for name in ("mesh/area", "target/face", "target/share", "target/amplitude"))
            press = run.attrs["radiation_per_square"]
            method = run["methods/radiation"]
            p, radiation = method["pressure"][:], method["radiation"][:]
            centres = run["mesh/vertices"][:][run["mesh/triangles"][:]].mean(axis=1)
            distance = numpy.linalg.norm(centres[:, None] - centres[face][None], axis=2).min(axis=1)
            near = distance <= 343.21 / run.attrs["frequency"]
            share, goal = numpy.zeros(len(area)), numpy.zeros(len(area))
            share[face], goal[face] = inside, press * wanted**2
            misfit = (near * area * (share * (radiation - goal) ** 2 + (1 - share) * radiation**2)).sum() / goal.max()
            energy = (area * (1 - share) * press * numpy.abs(p) ** 2).sum()
            cost = (misfit + 0.3 * energy) / (goal.max() * (area * share).sum())
            self.assertAlmostEqual(method.attrs["cost"] / cost, 1, delta=2e-3)
            self.assertTrue((numpy.diff(method["cost"][:]) <= 0).all())
            error = {name: found.attrs["relative_error_radiation"] for name, found in run["methods"].items()}
        self.assertLess(error["radiation"], error["surface"] - 0.05)
        self.is_refused("run", scene, "-o", "no", "--set", "solve.outside_weight=0", says=[
            "solve.outside_weight = 0: method radiation needs the skin outside the target; it must be > 0"])

    def test_best_pressure_of_radiation(self):
        scene = self.scene("best", "[radiation]")
        kernels = {"OPENBLAS_CORETYPE": "Haswell"}  # rounding decides which local minimum it ends in
        self.run_ok("run", scene, "-o", "best", env=kernels)
        with h5py.File(self.folder / "best" / "run.h5") as run:
            best, error = run["target/amplitude"][0], run["methods/radiation"].attrs["relative_error_radiation"]
        for factor, worse in ((0.3, -0.01), (30, 0.1)):  # fainter ones differ by little: the level is free
            self.run_ok("run", scene, "-o", f"x{factor}", "--set", f"target.pressure_pa={factor * best}", env=kernels)
            with h5py.File(self.folder / f"x{factor}" / "run.h5") as run:
                self.assertGreater(run["methods/radiation"].attrs["relative_error_radiation"], error + worse)

    MOVED = "[{surface: {start: spectral, iterations: 300}}, paper, focus, gs, eigen]"

    def moved(self, name, replacements):
        text = self.scene(500, self.MOVED).read_text()
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new)
        scene = self.write(f"{name}.yaml", text)
        self.run_ok("run", scene, "-o", name)
        with h5py.File(self.folder / name / "run.h5") as run:
            return {key: numpy.abs(method["pressure"][:]) for key, method in run["methods"].items()}

    def assert_same_pressures(self, got, expected, surface, others):
        self.assertEqual(sorted(got), sorted(expected))
        for name, pressure in expected.items():
            largest = numpy.abs(got[name] - pressure).max() / pressure.max()
            self.assertLess(largest, surface if name == "surface" else others, name)

    def test_a_rotated_scene_has_the_same_answer(self):
        """All of it by 90 degrees about x, then moved: (x, y, z) -> (x + 40, -z - 25, y + 300)."""
        here = self.moved("here", [])
        there = self.moved("there", [
            ("pitch_mm: 10.16}\n", "pitch_mm: 10.16}\n  at_mm: [40, -25, 300]\n  rotate_deg: [90, 0, 0]\n"),
            ("at_mm: [0, 0, 60]", "at_mm: [40, -85, 300], rotate_deg: [90, 0, 0]"),
            ("size_mm: [8, 12, 6]", "size_mm: [8, 6, 12]")])
        # Rounding of the coordinates, grown by the condition of B and by the steps: 2e-7 was seen. surface drops drives
        # below 1e-4 of what the array can do, and rounding moves where exactly that cut is: 2e-5.
        self.assert_same_pressures(there, here, surface=1e-4, others=1e-6)

    def test_the_order_of_the_transducers_does_not_matter(self):
        grid = [[10.16 * (i - 3.5), 10.16 * (j - 3.5), 0] for j in range(8) for i in range(8)]
        order = numpy.random.default_rng(1).permutation(64)
        was = "grid: {count: [8, 8], pitch_mm: 10.16}"
        here = self.moved("here", [(was, f"positions: {{points_mm: {grid}}}")])
        there = self.moved("there", [(was, f"positions: {{points_mm: {[grid[i] for i in order]}}}")])
        self.assert_same_pressures(there, here, surface=1e-6, others=1e-7)  # 4e-8 and 7e-9 were seen


if __name__ == "__main__":
    unittest.main()
