"""Standard streams that are full, closed or left by their reader: results are kept, and the exit code says it."""

import shlex
import subprocess
import unittest

from files_test import SCENE, TETRAHEDRON
from support import PROGRAM, CommandTest


class Streams(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("skin.obj", TETRAHEDRON)
        self.write("small.yaml", SCENE)
        self.write("s.yaml", "base: small.yaml\ngrid: {array.level: [0.5, 1]}\n")

    def shell(self, arguments, redirection):
        """Runs a command with its streams redirected by bash; the exit code is the command's own."""
        command = f"{shlex.quote(PROGRAM)} {arguments} {redirection}; exit ${{PIPESTATUS[0]}}"
        return subprocess.run(["bash", "-c", command], cwd=self.folder, capture_output=True, text=True, timeout=500,
                              check=False)

    def test_a_run_ends_whatever_becomes_of_its_messages(self):
        for number, (redirection, says) in enumerate([("2>/dev/full", "standard error"), (">&-", "standard output"),
                                                      ("| true", "standard output"), ("<&- >&- 2>&-", None)]):
            with self.subTest(redirection):
                out = self.folder / f"out{number}"
                done = self.shell(f"run small.yaml --threads 1 -o {out.name}", redirection)
                self.assertEqual(done.returncode, 1, done.stderr)
                if says:
                    self.assertIn(says, done.stdout + done.stderr)
                self.assertFalse((out / "failed.json").exists())
                self.assertIn("results in", (out / "run.log").read_text())
                self.assertEqual(self.touchfield("compare", out.name, "out0", "--tolerance", 0).returncode, 0)

    def test_a_sweep_ends_whatever_becomes_of_its_messages(self):
        for number, redirection in enumerate(["2>/dev/full", ">&-", "--json >/dev/full"]):
            with self.subTest(redirection):
                done = self.shell(f"sweep s.yaml --threads 1 -o out{number}", redirection)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn("standard", done.stdout + done.stderr)
                table = (self.folder / f"out{number}/sweep.csv").read_text().splitlines()
                self.assertEqual(len(table), 3)

    def test_every_command_notices(self):
        self.run_ok("run", "small.yaml", "--threads", 1, "-o", "out", "--quiet")
        for command in ["info out", "compare out out", "check small.yaml", "schema", "mesh skin.obj", "hand -o hand.stl --edge-mm 8",
                        "--help"]:
            with self.subTest(command):
                done = self.shell(command, ">/dev/full")
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn("standard output", done.stderr)
        # The error that there was stays the error that is said.
        for redirection in ["2>/dev/full", "2>&-"]:
            self.assertEqual(self.shell("info nothing.h5", redirection).returncode, 2)

    def test_a_reader_that_has_seen_enough(self):
        done = self.shell("schema --format json", "| head -3")  # more than a pipe holds
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), 3)
        self.assertIn("standard output", done.stderr)


if __name__ == "__main__":
    unittest.main()
