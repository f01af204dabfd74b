"""Burton-Miller on spheres of 20,480 faces, through the command line."""

import unittest

from sphere_runs import SphereRuns


class LargeSphere(SphereRuns):
    def test_ka_25(self):
        found, steps = self.errors(5, 25, "burton_miller", "burton_miller_polished")
        self.assertLess(found["burton_miller"], 0.011)
        self.assertLess(found["burton_miller_polished"], 0.0045)
        self.assertLessEqual(steps, 20)

    def test_ka_25_in_few_steps(self):
        found, steps = self.errors(5, 25, "burton_miller", options="tolerance: 1e-3")
        self.assertLess(found["burton_miller"], 0.011)
        self.assertLessEqual(steps, 12)


if __name__ == "__main__":
    unittest.main()
