"""Two rigid spheres 0.5 mm apart against acoutreams. Skipped where that is not installed."""

import pathlib
import sys
import unittest

from support import PROGRAM, script

try:
    import acoutreams  # noqa: F401
except Exception as missing:  # of another SciPy than it was compiled for, it raises more than ImportError
    print(f"skipped: acoutreams: {missing}")
    sys.exit(77)


class SphereClusters(unittest.TestCase):
    def test_a_gap_of_half_a_millimetre(self):
        spheres = script("spheres_scattering")
        reference = spheres.Reference(2, 0.5, 14)
        self.assertLess(reference.slope(), 0.02)
        coarse, fine = (spheres.errors(pathlib.Path(PROGRAM), 2, 0.5, edge, reference) for edge in (1.5, 0.75))
        # docs/stability.md claims 0.3 to 3 % for burton_miller_polished where gaps are not narrower than half an edge, as with
        # the finer edges here; the others, of three gaps, have it too.
        for row in (coarse, fine):
            self.assertLess(float(row["burton_miller_polished"]), 0.03)
        for scheme in spheres.SCHEMES:
            self.assertGreater(float(fine[scheme]), 0)
            self.assertLess(float(fine[scheme]), 0.6 * float(coarse[scheme]))


if __name__ == "__main__":
    unittest.main()
