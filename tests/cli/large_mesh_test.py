"""A mesh file of a million faces through the command line."""

import json
import resource
import unittest

from meshes import icosphere, write_stl
from support import CommandTest


class LargeMesh(CommandTest):
    def test_a_million_faces(self):
        write_stl(self.folder / "large.stl", *icosphere(8, 80))
        report = json.loads(self.run_ok("mesh", "large.stl", "-o", "out.stl", "--json").stdout)
        self.assertEqual(report["faces"], 20 * 4**8)
        self.assertTrue(report["usable"])
        self.assertEqual(report["result"]["vertices"], 10 * 4**8 + 2)  # an STL file's points are welded
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, 2**21)  # 2 GiB


if __name__ == "__main__":
    unittest.main()
