"""The schemes on rigid spheres, through the command line and run.h5 alone: accuracy, order, fictitious frequencies."""

import math
import unittest

from meshes import write_stl
from sphere_runs import SphereRuns

# Where the inside of a sphere resonates: zeros of the spherical Bessel functions j_0, j_1 and j_0.
FICTITIOUS = [(math.pi, 2), (4.493409, 2), (3 * math.pi, 3)]
SAFE = ["chief", "burton_miller", "burton_miller_polished"]


class Schemes(SphereRuns):
    def check_errors(self, splits, ka, limits, **scene):
        found, _ = self.errors(splits, ka, *limits, **scene)
        for scheme, limit in limits.items():
            self.assertLess(found[scheme], limit, scheme)

    def test_accuracy_at_6_edges_a_wavelength(self):
        self.check_errors(4, 13, {"burton_miller": 0.014, "burton_miller_polished": 0.0055})
        self.check_errors(4, 13, {"chief": 0.010})
        self.check_errors(4, 13, {"paper_corrected": 0.013}, options="solver: matrix_free")

    def test_stl_in_single_precision_gives_the_same(self):
        ply, _ = self.errors(3, 5.1, "burton_miller_polished")
        stl, _ = self.errors(3, 5.1, "burton_miller_polished", write=write_stl, ending="stl")
        self.assertAlmostEqual(stl["burton_miller_polished"], ply["burton_miller_polished"], delta=1e-5)

    def test_order_in_the_edge(self):
        # Each step halves the edge. The polished scheme and those with a better diagonal come near second order on
        # smooth bodies; nothing may be faster than that by luck, nor slower than first order.
        orders = {"paper": (0.9, 1.3), "paper_corrected": (1.7, 2.3), "chief": (1.7, 2.3), "burton_miller": (1.0, 2.0),
                  "burton_miller_polished": (1.3, 2.2)}
        iterated = [scheme for scheme in orders if scheme != "chief"]
        ladder = []
        for splits in [2, 3, 4]:
            found, _ = self.errors(splits, 5.1, *iterated, options="solver: matrix_free")
            ladder.append(found | self.errors(splits, 5.1, "chief")[0])
        for coarse, fine in zip(ladder, ladder[1:]):
            for scheme, (least, most) in orders.items():
                order = math.log2(coarse[scheme] / fine[scheme])
                print(f"{scheme}: order {order:.2f}")
                self.assertTrue(least <= order <= most, f"{scheme}: order {order}")

    def test_fictitious_frequencies_do_not_show(self):
        for ka, splits in FICTITIOUS:
            away, _ = self.errors(splits, 0.98 * ka, *SAFE)
            for near in [0.995, 1, 1.005]:
                found, _ = self.errors(splits, near * ka, *SAFE)
                for scheme in SAFE:
                    self.assertLess(found[scheme], 1.3 * away[scheme], f"{scheme}, {near} x {ka}")

    def test_fictitious_frequencies_are_where_they_should_be(self):
        # Else the test above would look beside them.
        for ka, splits in FICTITIOUS[:2]:
            away, _ = self.errors(splits, 0.98 * ka, "paper_corrected")
            found, _ = self.errors(splits, ka, "paper_corrected")
            self.assertGreater(found["paper_corrected"], 3 * away["paper_corrected"])

    def test_few_steps(self):
        # Up to 10 edges a wavelength; more are wasted, and cost more steps: the derivative's matrix grows as 1/edge.
        for splits, ka in [(2, math.pi), (2, 5.1), (3, 5.1), (3, 3 * math.pi), (3, 13), (4, 3 * math.pi), (4, 13)]:
            _, steps = self.errors(splits, ka, "burton_miller", options="tolerance: 1e-3")
            self.assertLessEqual(steps, 12)


if __name__ == "__main__":
    unittest.main()
