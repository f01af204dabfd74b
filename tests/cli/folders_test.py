"""A run's folder: whole or not there, of one process at a time, and with nothing in it that is somebody else's."""

import fcntl
import json
import os
import random
import re
import shutil
import signal
import subprocess
import time
import unittest

import h5py

from files_test import SCENE, TETRAHEDRON
from fit_test import SEEN as HAND_SEEN
from live_test import SCENE as SWING
from see_test import SEEN
from sweep_test import TINY
from support import LONG, PROGRAM, CommandTest

MINE = ["run", "small.yaml", "-o", "out", "--quiet", "--threads", "1"]
FILES = {"run.h5", "metrics.csv", "run.log", "side.vti", "run.vtm"}


class FolderTest(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("skin.obj", TETRAHEDRON)
        self.write("small.yaml", SCENE)
        self.out = self.folder / "out"

    def start(self, *arguments):
        return subprocess.Popen([PROGRAM, *MINE, *arguments], cwd=self.folder, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True)

    def level(self, out=None):
        """The drive of the run that the folder holds, all of whose files are there."""
        out = out or self.out
        listed = set(json.loads((out / "files.json").read_text())["files"])
        self.assertEqual({path.name for path in out.iterdir()}, listed | {"files.json"})
        self.assertEqual(listed, FILES)
        with h5py.File(out / "run.h5") as run:
            self.assertEqual(run.attrs["complete"], 1)
            return float(re.search(r"level: ([\d.]+)", run["scene"][()].decode())[1])

    def nothing_else(self):
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("out")], ["out"])

    def pairs(self, count):
        for number in range(count):
            shutil.rmtree(self.out, ignore_errors=True)
            runs = [self.start("--set", f"array.level={level}") for level in (0.9, 0.8)]
            said = [run.communicate(timeout=300)[1] for run in runs]
            self.assertEqual(sorted(run.returncode for run in runs), [0, 2], (number, said))
            refused = next(text for text, run in zip(said, runs) if run.returncode == 2)
            self.assertRegex(refused, "another process works in it|already holds a run")
            self.assertEqual(self.level(), 0.9 if runs[0].returncode == 0 else 0.8)
            self.nothing_else()

    def kills(self, count, seed=54):
        chance = random.Random(seed)
        began = time.monotonic()
        self.run_ok(*MINE, "--set", "array.level=0.5")
        lasts = time.monotonic() - began
        held, number, killed, replaced = 0.5, 0, 0, 0
        while killed < count:
            number += 1
            new = round(0.5 + 0.4 * number / (4 * count), 5)
            run = self.start("--force", "--set", f"array.level={new}")
            if number % 2:  # about when the folders change places
                while run.poll() is None and not (self.folder / "out.partial/run.vtm").exists():
                    time.sleep(0.0005)
                time.sleep(chance.uniform(0, lasts / 2))
            else:
                time.sleep(chance.uniform(0, lasts))
            run.kill()
            run.communicate()
            killed += run.returncode == -signal.SIGKILL
            found = self.level()
            self.assertIn(found, (held, new), number)
            self.assertTrue(run.returncode or found == new)
            replaced += found == new
            held = found
        self.run_ok(*MINE, "--force", "--set", "array.level=1")
        self.assertEqual(self.level(), 1)
        self.nothing_else()
        print(f"{number} starts, {killed} killed, {replaced} times the new run")


class Folders(FolderTest):
    def test_of_two_one_succeeds(self):
        self.pairs(5)

    def test_a_kill_leaves_the_old_or_the_new_run(self):
        self.kills(12)

    def test_every_command_is_refused_beside_a_process_at_work(self):
        moving = TINY + "motion: {seconds: 0.1, change: [{path: 'body.place.at_mm[0]', rate: 40}]}\n"
        for name, text in {"moving": moving, "seen": SEEN, "swing": SWING, "hand": HAND_SEEN}.items():
            self.write(f"{name}.yaml", text)
        self.run_ok("see", "hand.yaml", "-o", "images", "--quiet", "--set", "motion.seconds=0.01")
        self.out.mkdir()
        held = os.open(self.out, os.O_RDONLY)
        self.addCleanup(os.close, held)
        fcntl.flock(held, fcntl.LOCK_EX)
        for command in (["run", "small.yaml"], ["play", "moving.yaml"], ["see", "seen.yaml"], ["fit", "images"], ["study", "small.yaml"],
                        ["live", "swing.yaml", "--method", "unscattered"]):
            with self.subTest(command=command):
                self.is_refused(*command, "-o", "out", "--quiet", "--force",
                                says=["output directory out: another process", "wait for it, or give another"])
                self.assertEqual(list(self.out.iterdir()), [])
        self.assertFalse((self.folder / "out.partial").exists())
        fcntl.flock(held, fcntl.LOCK_UN)
        self.run_ok(*MINE)

    def test_what_is_not_a_runs_is_refused_and_named(self):
        self.run_ok(*MINE)
        (self.folder / "elsewhere").mkdir()
        self.write("elsewhere/precious", "mine")
        for name, make in [("notes.txt", lambda path: path.write_text("mine")), ("more", lambda path: path.mkdir()),
                           (".a.tmp-b", lambda path: path.write_text("mine")),
                           ("link", lambda path: path.symlink_to("../elsewhere"))]:
            make(self.out / name)
            self.is_refused(*MINE, "--force", says=f"output directory out: its {name} does not belong to a run")
            (self.out / name).rmdir() if name == "more" else (self.out / name).unlink()
        # A list that leads elsewhere removes nothing there.
        listed = [*FILES, "../elsewhere/precious", str(self.folder / "elsewhere/precious"), "..", "elsewhere/precious"]
        self.write("out/files.json", json.dumps({"format": "touchfield-files", "files": listed}))
        self.write("out/.run.h5.tmp-0123456789abcdef", "of a process that was killed")
        self.run_ok(*MINE, "--force")
        self.level()
        self.assertEqual((self.folder / "elsewhere/precious").read_text(), "mine")
        self.write("out/files.json", "mine")
        self.is_refused(*MINE, "--force", says="does not belong to a run")

    def test_results_of_an_unfinished_run_are_kept(self):
        partial = self.folder / "out.partial"
        partial.mkdir()
        manifest = json.dumps({"format": "touchfield-files", "files": sorted(FILES)})
        self.write("out.partial/files.json", manifest)
        self.write("out.partial/run.log", "a log alone holds nobody up")
        self.run_ok(*MINE)
        self.nothing_else()
        self.out.rename(partial)
        self.is_refused(*MINE, says=("output directory out: out.partial holds results of an unfinished run", "--force"))
        said = self.run_ok("info", "out")
        self.assertIn("out.partial holds a run that has not ended", said.stderr)
        self.assertIn("small", said.stdout)
        self.run_ok(*MINE, "--force")
        self.nothing_else()

    def test_a_folder_that_keeps_its_name_gets_its_files(self):
        self.write("here.yaml", SCENE.replace("skin.obj", "../skin.obj"))
        self.out.mkdir()
        self.write("out/small.yaml", (self.folder / "here.yaml").read_text())
        (self.folder / "link").symlink_to("out")
        for where, scene, out in [(self.folder, "small.yaml", "link/"), (self.out, "../small.yaml", ".")]:
            inode = self.out.stat().st_ino
            (self.out / "small.yaml").unlink(missing_ok=True)
            for force in [[], ["--force"]]:
                done = self.touchfield("run", scene, "-o", out, "--quiet", *force, cwd=where)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.level()
            self.assertEqual(self.out.stat().st_ino, inode)
            self.assertTrue((self.folder / "link").is_symlink())
            for path in self.out.iterdir():
                path.unlink()

    def test_names_in_the_way(self):
        self.write("file", "mine")
        (self.folder / "nowhere").symlink_to("none")
        for name, says in [("file", "a file of that name is in the way"), ("nowhere", "a file of that name is in the way"),
                           ("file/out", "a file of that name is in the way"), ("/proc/out", "output directory /proc/out.partial cannot be made")]:
            self.is_refused("run", "small.yaml", "-o", name, says=says)

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_file_systems_that_lack_something(self):
        def shim(name, code):
            source = self.write(f"{name}.c", f"#define _GNU_SOURCE\n#include <errno.h>\n#include <stdio.h>\n#include <unistd.h>\n{code}\n")
            subprocess.run(["cc", "-shared", "-fPIC", "-o", self.folder / f"{name}.so", source], check=True)
            return {"LD_PRELOAD": str(self.folder / f"{name}.so")}

        exchange = "int renameat2(int a, const char* b, int c, const char* d, unsigned e) {{ {} }}"
        for name, code in [("nolock", "int flock(int fd, int op) { errno = ENOLCK; return -1; }"),
                           ("nosys", "int flock(int fd, int op) { errno = ENOSYS; return -1; }"),
                           ("noexchange", exchange.format("errno = EINVAL; return -1;"))]:
            lacking = shim(name, code)
            for force in [[], ["--force"]]:
                said = self.run_ok(*MINE, *force, env=lacking).stderr
                self.assertEqual("warning: locks: " in said, name != "noexchange", said)
                self.level()
                self.nothing_else()
            shutil.rmtree(self.out)
        # Killed between its two renames.
        self.run_ok(*MINE, "--set", "array.level=0.5")
        ending = shim("ending", exchange.format('if (rename("out", "out.replaced") == 0) _exit(9); return -1;'))
        self.assertEqual(self.touchfield(*MINE, "--force", env=ending).returncode, 9)
        self.assertFalse(self.out.exists())
        self.is_refused(*MINE, says="already holds a run")
        self.assertEqual(self.level(), 0.5)
        self.run_ok(*MINE, "--force")
        self.nothing_else()


@LONG
class Long(FolderTest):
    def test_pairs(self):
        self.pairs(200)

    def test_kills(self):
        self.kills(200)


if __name__ == "__main__":
    unittest.main()
