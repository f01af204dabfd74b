"""A directory of results is of one process at a time, what links in it lead to stays, and the killed leave nothing."""

import fcntl
import os
import unittest

from fit_test import SEEN as HAND_SEEN
from live_test import SCENE as SWING
from see_test import SEEN
from support import CommandTest
from sweep_test import TINY

MOVING = TINY.replace("methods: [focus, paper]", "methods: [focus]") + "motion: {seconds: 0.1, change: [{path: 'body.place.at_mm[0]', rate: 40}]}\n"
DEAD = "0123456789abcdef"


class Claims(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", TINY)
        self.write("sweep.yaml", "base: tiny.yaml\ngrid: {array.level: [1, 0.9]}\n")
        self.out = self.folder / "out"

    def refused(self, done, *phrases):
        self.assertEqual(done.returncode, 2, done.stderr)
        said = [line for line in done.stderr.strip().splitlines() if not line.startswith("touchfield: warning: ")]
        self.assertEqual(len(said), 1, done.stderr)
        for phrase in phrases:
            self.assertIn(phrase, done.stderr)

    # Two processes

    def test_every_command_is_refused_beside_a_process_at_work(self):
        self.write("moving.yaml", MOVING)
        self.write("seen.yaml", SEEN)
        self.write("swing.yaml", SWING)
        self.run_ok("see", self.write("hand.yaml", HAND_SEEN), "-o", "images", "--quiet", "--set", "motion.seconds=0.01")
        self.out.mkdir()
        commands = [["run", "tiny.yaml"], ["play", "moving.yaml"], ["see", "seen.yaml"], ["fit", "images"], ["study", "tiny.yaml"],
                    ["live", "swing.yaml", "--method", "unscattered"]]
        held = os.open(self.out, os.O_RDONLY)
        self.addCleanup(os.close, held)
        fcntl.flock(held, fcntl.LOCK_EX)
        for command in commands:
            for force in [[], ["--force"]]:
                with self.subTest(command=command, force=force):
                    done = self.touchfield(*command, "-o", "out", "--quiet", *force)
                    self.refused(done, "output directory out: another process", "wait for it, or give another")
                    self.assertEqual(list(self.out.iterdir()), [])
        self.assertFalse((self.folder / "out.partial").exists())
        fcntl.flock(held, fcntl.LOCK_UN)
        self.run_ok("run", "tiny.yaml", "-o", "out", "--quiet")

    def test_leftovers_of_sweeps_and_single_files_go(self):
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        names = [f"out/.{name}.tmp-{DEAD}" for name in ("sweep.csv", "sweep.json", "sweep_relative_error.png")]
        for name in names:
            self.write(name, "half")
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        self.assertEqual([path for path in self.out.iterdir() if path.name.startswith(".")], [])
        self.write(f".hand.stl.tmp-{DEAD}", "half")
        self.run_ok("hand", "-o", "hand.stl", "--edge-mm", 8)
        self.write(f".frame.txt.tmp-{DEAD}", "half")
        self.run_ok("send", "out/cases/00001", "--method", "focus", "--to", "dry-run:frame.txt")
        self.assertEqual([name for name in self.entries() if name.startswith(".")], [])


if __name__ == "__main__":
    unittest.main()
