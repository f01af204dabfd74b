"""What touchfield info says of a motion.h5, by its path and by its directory."""

import json
import unittest

from support import CommandTest


class MotionFile(CommandTest):
    def test_info(self):
        self.write_samples()
        said = self.run_ok("info", "motion.h5").stdout
        for part in ["a motion of 0.2 s, complete", "judge     80 faces", "4 frames (1 quiet, 1 of them lost, 1 late), 3 dropped, 6 scores",
                     "median 47.0 ms", "72.50 %", "86.00 %"]:
            self.assertIn(part, said)
        summary = json.loads(self.run_ok("info", "motion.h5", "--json").stdout)
        self.assertEqual([method["name"] for method in summary["methods"]], ["surface", "paper-2"])
        method = summary["methods"][1]
        self.assertAlmostEqual(method["relative_error_p95"], 0.86, places=12)
        self.assertEqual([method[name] for name in ("frames", "quiet", "dropped", "relative_error_count")], [4, 1, 3, 4])
        self.assertIsNone(method["leakage_worst"])

    def test_a_directory_is_described_by_its_run_or_else_its_motion(self):
        self.write_samples()
        self.assertNotIn("a motion of", self.run_ok("info", ".").stdout)
        (self.folder / "run.h5").unlink()
        self.assertIn("a motion of", self.run_ok("info", ".").stdout)

    def test_damage_and_commands_that_take_runs(self):
        self.write_samples()
        whole = (self.folder / "motion.h5").read_bytes()
        done = self.touchfield("compare", "motion.h5", "run.h5")
        self.assertEqual(done.returncode, 2)
        self.assertIn("not a touchfield run", done.stderr)
        (self.folder / "motion.h5").write_bytes(whole[:len(whole) // 2])
        done = self.touchfield("info", "motion.h5")
        self.assertEqual(done.returncode, 2)
        self.assertIn("motion.h5", done.stderr)
        self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main()
