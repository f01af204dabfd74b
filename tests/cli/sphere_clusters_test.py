"""Two rigid spheres 0.5 mm apart against acoutreams. Skipped where that is not installed."""

import pathlib
import sys
import tempfile
import unittest

from support import PROGRAM, SOURCE

try:
    import acoutreams  # noqa: F401
except Exception as missing:  # of another SciPy than it was compiled for, it raises more than ImportError
    print(f"skipped: acoutreams: {missing}")
    sys.exit(77)


class SphereClusters(unittest.TestCase):
    def test_a_gap_of_half_a_millimetre(self):
        sys.path.insert(0, str(SOURCE / "scripts/makers"))
        import spheres
        import work
        reference = spheres.Cluster(2, 0.5, 14)
        self.assertLess(reference.slope(), 0.02)
        with tempfile.TemporaryDirectory() as folder:
            own = work.Work(PROGRAM, SOURCE / "build/release", pathlib.Path(folder), 1, pathlib.Path(folder))
            coarse, fine = (spheres.cluster_errors(own, 2, 0.5, edge, reference) for edge in (1.5, 0.75))
        # docs/stability.md claims 0.3 to 3 % for burton_miller_polished where gaps are not narrower than half an edge, as with
        # the finer edges here; the others, of three gaps, have it too.
        for row in (coarse, fine):
            self.assertLess(float(row["burton_miller_polished"]), 0.03)
        for scheme in spheres.CLUSTER_SCHEMES:
            self.assertGreater(float(fine[scheme]), 0)
            self.assertLess(float(fine[scheme]), 0.6 * float(coarse[scheme]))


if __name__ == "__main__":
    unittest.main()
