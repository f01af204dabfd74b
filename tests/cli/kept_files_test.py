"""A run.h5 and a sweep that an earlier version wrote (tests/data/kept): read, compared, sent, repeated, resumed."""

import csv
import json
import re
import shutil
import unittest

from support import SOURCE, CommandTest

KEPT = SOURCE / "tests/data/kept"


def table(folder):
    with open(folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


class KeptFiles(CommandTest):
    def setUp(self):
        super().setUp()
        shutil.copytree(KEPT, self.folder / "kept")

    def test_the_run_is_described(self):
        known = json.loads(self.run_ok("info", "kept/run", "--json").stdout)
        self.assertEqual(known["name"], "tiny")
        self.assertTrue(known["complete"])
        self.assertEqual([method["name"] for method in known["methods"]], ["focus", "paper"])
        self.assertEqual(known["faces"], 180)

    def test_the_run_is_repeated_with_the_defaults_it_was_made_with(self):
        self.run_ok("run", "--from", "kept/run", "-o", "again", "--quiet")
        done = self.touchfield("compare", "kept/run", "again", "--tolerance", "1e-6").stdout
        # Keys that have come since are at their defaults; forces are estimated otherwise since.
        self.assertIn("scene     the same\n", done)
        self.assertIn("          A lacks 2 keys that B has at their defaults: solve.methods[1].paper.faces, "
                      "solve.device\n", done)
        self.assertNotIn("scene_hash", done)
        self.assertNotIn("the scene:", done)
        differing = re.findall(r"^  (?:focus|paper) +([a-z_]+) +\S+ +\S+ +\S+$", done, re.MULTILINE)
        self.assertLessEqual(set(differing), {"force_target_n", "force_elsewhere_n"})
        phases = re.findall(r"^  (?:focus|paper) +([-.e\d]+) +[-.e\d]+ +0 ", done, re.MULTILINE)
        self.assertEqual(len(phases), 2)
        self.assertLess(max(map(float, phases)), 1e-6)  # another version, another order of sums

    def test_the_run_is_the_start_of_another(self):
        scene = (KEPT / "tiny.yaml").read_text().replace("iterations: 4", "iterations: 4\n  start: {previous: kept/run/run.h5}")
        self.run_ok("run", self.write("next.yaml", scene), "-o", "next", "--quiet")

    def test_the_run_is_sent(self):
        done = self.run_ok("send", "kept/run", "--method", "paper", "--to", "dry-run:frame.txt")
        self.assertIn("1 file written", done.stdout)

    def test_the_sweep_is_collected_and_resumed(self):
        old = table(self.folder / "kept/sweep")
        self.assertIn("3 of 3 cases done, 0 failed", self.run_ok("sweep", "--collect", "kept/sweep").stdout)
        self.assertEqual(table(self.folder / "kept/sweep"), old)
        shutil.rmtree(self.folder / "kept/sweep/cases/00002")
        done = self.run_ok("sweep", "kept/sweep.yaml", "-o", "kept/sweep", "--resume", "--json")
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["computed"], 1)
        self.assertIn("a version with other defaults began this sweep", done.stderr)
        new = table(self.folder / "kept/sweep")
        self.assertEqual(len(new), len(old))
        for before, after in zip(old, new):
            self.assertEqual(before["method"], after["method"])
            self.assertAlmostEqual(float(before["relative_error"]), float(after["relative_error"]), delta=1e-9)


if __name__ == "__main__":
    unittest.main()
