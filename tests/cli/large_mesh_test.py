"""Large bodies through the command line: a mesh file of a million faces, and a hand that single precision cannot solve."""

import json
import resource
import unittest

from meshes import icosphere, write_stl
from support import SOURCE, CommandTest


class LargeMesh(CommandTest):
    def test_a_million_faces(self):
        write_stl(self.folder / "large.stl", *icosphere(8, 80))
        report = json.loads(self.run_ok("mesh", "large.stl", "-o", "out.stl", "--json").stdout)
        self.assertEqual(report["faces"], 20 * 4**8)
        self.assertTrue(report["usable"])
        self.assertEqual(report["result"]["vertices"], 10 * 4**8 + 2)  # an STL file's points are welded
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, 2**21)  # 2 GiB

    # The published scheme on the shipped grasp has a condition number of 3e7, which leaves single precision no digit.
    def test_a_badly_conditioned_body_is_solved_in_double_precision(self):
        changes = ["field=[]", "write=[h5]", "evaluation=none", "solve.allow_coarse_mesh=true",
                   "solve.methods=[{paper: {scheme: paper, iterations: 1}}]"]
        self.run_ok("run", SOURCE / "scenes/grasp.yaml", "-o", "grasp", *(part for change in changes for part in ("--set", change)))
        self.assertIn("again in double precision", (self.folder / "grasp/run.log").read_text())


if __name__ == "__main__":
    unittest.main()
