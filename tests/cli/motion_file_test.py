"""What touchfield info says of a motion.h5, by its path and by its directory."""

import json
import unittest

from support import CommandTest


class MotionFile(CommandTest):
    def test_info(self):
        self.write_samples()
        said = self.run_ok("info", "motion.h5").stdout
        for part in [r"seconds +0\.2\n", r"complete +yes\n", r"evaluation mesh +faces 80,", r"  paper-2 +surface +chief +4 +1 +1 +1 +3 +6 +47\.0 ",
                     r"72\.5 \| 86\.0 "]:
            self.assertRegex(said, part)
        summary = json.loads(self.run_ok("info", "motion.h5", "--json").stdout)
        self.assertEqual([method["name"] for method in summary["methods"]], ["surface", "paper-2"])
        method = summary["methods"][1]
        self.assertAlmostEqual(method["relative_error_p95"], 0.86, places=12)
        self.assertEqual([method[name] for name in ("frames", "silent", "dropped", "relative_error_count")], [4, 1, 3, 4])
        self.assertIsNone(method["leakage_worst"])

    def test_a_directory_is_described_by_its_run_or_else_its_motion(self):
        self.write_samples()
        self.assertNotIn("evaluation faces", self.run_ok("info", ".").stdout)
        (self.folder / "run.h5").unlink()
        self.assertIn("evaluation faces", self.run_ok("info", ".").stdout)

    def test_damage_and_commands_that_take_runs(self):
        self.write_samples()
        whole = (self.folder / "motion.h5").read_bytes()
        self.is_refused("compare", "motion.h5", "run.h5", says="not a touchfield run")
        (self.folder / "motion.h5").write_bytes(whole[:len(whole) // 2])
        done = self.is_refused("info", "motion.h5", says="motion.h5")
        self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main()
