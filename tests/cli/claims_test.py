"""A directory of results is of one process at a time, what links in it lead to stays, and the killed leave nothing."""

import fcntl
import os
import shutil
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
                    ["live", "swing.yaml", "--method", "unscattered"], ["sweep", "sweep.yaml"]]
        held = os.open(self.out, os.O_RDONLY)
        self.addCleanup(os.close, held)
        fcntl.flock(held, fcntl.LOCK_EX)
        for command in commands:
            for force in [[], ["--force"]]:
                with self.subTest(command=command, force=force):
                    if command[0] == "sweep" and force:
                        force = ["--case", "1"]
                    done = self.touchfield(*command, "-o", "out", "--quiet", *force)
                    self.refused(done, "output directory out: another process", "wait for it, or give another")
                    self.assertEqual(list(self.out.iterdir()), [])
        self.assertFalse((self.folder / "out.partial").exists())
        fcntl.flock(held, fcntl.LOCK_UN)
        self.run_ok("run", "tiny.yaml", "-o", "out", "--quiet")

    def test_leftovers_of_sweeps_and_single_files_go(self):
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        names = [f"out/.{name}.tmp-{DEAD}" for name in ("sweep.csv", "sweep.json", "sweep_relative_error.png")]
        for arguments in [["sweep.yaml", "-o", "out"], ["--collect", "out"]]:
            for name in names:
                self.write(name, "half")
            self.run_ok("sweep", *arguments, "--quiet")
            self.assertEqual([path for path in self.out.iterdir() if path.name.startswith(".")], [])
        self.write(f".hand.stl.tmp-{DEAD}", "half")
        self.run_ok("hand", "-o", "hand.stl", "--edge-mm", 8)
        self.write(f".frame.txt.tmp-{DEAD}", "half")
        self.run_ok("send", "out/cases/00001", "--method", "focus", "--to", "dry-run:frame.txt")
        self.assertEqual([name for name in self.entries() if name.startswith(".")], [])

    def test_a_killed_sweep_gives_back_what_was_others(self):
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        cases = self.out / "cases"
        self.write("out/cases/00001/notes.txt", "mine")
        # A finished case before it has its place, and between the removal of what was there and the renaming.
        shutil.copytree(cases / "00002", cases / ".00002.4711")
        self.write("out/cases/.00002.4711/notes.txt", "mine too")
        self.write("out/cases/00002/more.txt", "mine as well")
        (cases / "00001").rename(cases / ".00001.4711")
        (cases / ".00001.4712").mkdir()
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        self.assertEqual(sorted(path.name for path in cases.iterdir()), ["00001", "00002"])
        self.assertEqual((cases / "00001/notes.txt").read_text(), "mine")
        self.assertEqual((cases / "00002/notes.txt").read_text(), "mine too")
        self.assertEqual((cases / "00002/more.txt").read_text(), "mine as well")

    # Links

    def elsewhere(self):
        """A folder of somebody's, and how it is now."""
        folder = self.folder / "elsewhere"
        folder.mkdir(exist_ok=True)
        self.write("elsewhere/precious", "mine")
        return folder

    def unharmed(self):
        return {path.name: path.read_text() for path in (self.folder / "elsewhere").iterdir()} == {"precious": "mine"}

    def test_a_sweep_writes_and_removes_behind_no_link(self):
        self.elsewhere()
        for name, target, says in [("sweep.lock", "../elsewhere/precious", "sweep.lock is a link"),
                                   ("sweep.lock", "../elsewhere/new", "sweep.lock is a link"),
                                   ("cases", "../elsewhere", "cases is a link"), ("cases", "../new", "cases is a link"),
                                   ("sweep.log", "../elsewhere/precious", "sweep.log"), ("sweep.log", "../elsewhere/new", "sweep.log")]:
            with self.subTest(name=name, target=target):
                shutil.rmtree(self.out, ignore_errors=True)
                self.out.mkdir()
                os.symlink(target, self.out / name)
                done = self.touchfield("sweep", "sweep.yaml", "-o", "out", "--quiet")
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(says, done.stderr)
                self.assertTrue(self.unharmed())
        for name in ["sweep.lock", "sweep.log"]:
            shutil.rmtree(self.out)
            self.out.mkdir()
            os.link(self.folder / "elsewhere/precious", self.out / name)
            self.touchfield("sweep", "sweep.yaml", "-o", "out", "--quiet")
            self.assertTrue(self.unharmed())
        shutil.rmtree(self.out)
        for name in ["sweep.csv", "sweep_relative_error.png"]:
            self.out.mkdir(exist_ok=True)
            os.symlink("../elsewhere/precious", self.out / name)
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        self.assertTrue(self.unharmed())

    def test_a_case_that_is_a_link_takes_nothing_along(self):
        self.elsewhere()
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
        for target in ["../../elsewhere", "../../none"]:
            case = self.out / "cases/00002"
            shutil.rmtree(case, ignore_errors=True)
            case.symlink_to(target)
            (self.out / f"cases/.00001.{os.getpid()}").symlink_to("../../elsewhere")
            self.run_ok("sweep", "sweep.yaml", "-o", "out", "--quiet")
            self.assertFalse(case.is_symlink())
            self.assertTrue(self.unharmed())


if __name__ == "__main__":
    unittest.main()
