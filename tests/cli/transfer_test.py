"""The transfer matrix in run.h5, read as a user would: pressures, surface's cost, what is kept and compared."""

import unittest

import numpy

from support import SOURCE, CommandTest, open_run

QUICK = SOURCE / "scenes/capsule.yaml"


def drives(method):
    return method["amplitude"][:] * numpy.exp(1j * method["phase"][:])


class Matrix:
    """What /transfer of a run holds, which must be of one scheme."""

    def __init__(self, run):
        group, = run["transfer"].values()
        for name in ("face", "wanted", "share", "weight", "target", "outside", "incident"):
            setattr(self, name, group[name][:])
        self.attributes = dict(group.attrs)

    def cost(self, q):
        return (numpy.sum(self.weight * (numpy.abs(self.target @ q) - self.wanted) ** 2)
                + numpy.sum(numpy.abs(self.outside @ q) ** 2))

    def best_level(self, q):
        heard = numpy.abs(self.target @ q)
        energy = numpy.sum(self.weight * heard ** 2) + numpy.sum(numpy.abs(self.outside @ q) ** 2)
        return min(numpy.sum(self.weight * self.wanted * heard) / energy, 1 / numpy.max(numpy.abs(q)))


class Transfer(CommandTest):
    def test_pressures_and_costs_of_the_quick_scene(self):
        self.run_ok("run", QUICK, "-o", "out", "--quiet", "--set", "write=[transfer]", "--set", "field=null", "--set",
                    "solve.methods=[{surface: {start: zero}}, paper, unscattered, focus]", "--set", "solve.optimality_bound=true")
        with open_run(self.folder / "out") as run:
            matrix = Matrix(run)
            self.assertEqual(matrix.target.shape, (run["target/face"].size, 256))
            self.assertEqual(matrix.outside.shape[1], 256)
            numpy.testing.assert_array_equal(matrix.weight, matrix.share * run["mesh/area"][:][matrix.face])
            for name, method in run["methods"].items():
                q = drives(method)
                solved = method["pressure"][:][matrix.face]
                self.assertLess(numpy.linalg.norm(matrix.target @ q - solved), 1e-3 * numpy.linalg.norm(solved), name)
                scored = matrix.cost(matrix.best_level(q) * q)
                self.assertAlmostEqual(scored / method.attrs["cost_skin"], 1, delta=1e-10)
            surface = run["methods/surface"]
            self.assertAlmostEqual(matrix.cost(drives(surface)) / surface["cost"][-1], 1, delta=1e-10)
            self.assertAlmostEqual(matrix.cost(numpy.ones(256)) / surface["cost"][0], 1, delta=1e-10)
            # The rest of the skin, as far as `outside` tells: its energy.
            outside = run["mesh/area"][:]
            outside[matrix.face] -= matrix.weight
            energy = numpy.sum(outside * numpy.abs(surface["pressure"][:]) ** 2)
            self.assertAlmostEqual(numpy.sum(numpy.abs(matrix.outside @ drives(surface)) ** 2) / energy, 1, delta=1e-3)
        self.assertRegex(self.run_ok("info", "out").stdout, rf"target rows .*\n  burton_miller_polished +{len(matrix.face)} ")


if __name__ == "__main__":
    unittest.main()
