"""A directory of results is of one process at a time."""

import fcntl
import os
import unittest

from fit_test import SEEN as HAND_SEEN
from live_test import SCENE as SWING
from see_test import SEEN
from support import CommandTest
from sweep_test import TINY

MOVING = TINY.replace("methods: [focus, paper]", "methods: [focus]") + "motion: {seconds: 0.1, change: [{path: 'body.place.at_mm[0]', rate: 40}]}\n"


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


if __name__ == "__main__":
    unittest.main()
