"""Limits of the system and variables that libraries crash by: an error that says what to do, and no result lost."""

import contextlib
import json
import os
import pathlib
import re
import subprocess
import time
import unittest

from support import FINGER, PROGRAM, CommandTest

SCENE = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[focus]").replace(
    "write: [h5, vtp, vti]", "evaluation: none\nwrite: [h5]")
# Cores of OpenBLAS that some processors have no instructions for, and names of none.
CORES = ["Sandybridge", "zen", "SkylakeX", "Cooperlake", "x"]


class Limits(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("scene.yaml", SCENE)
        self.write("sweep.yaml", "base: scene.yaml\ngrid: {array.level: [1, 0.9]}\n")

    def under(self, limit, command, env=None):
        return subprocess.run(["bash", "-c", f"ulimit {limit}; exec {PROGRAM} {command}"], cwd=self.folder,
                              env=os.environ | (env or {}), capture_output=True, text=True, timeout=300, check=False)

    def test_too_little_address_space_is_said_at_once(self):
        for limit, command in (("-d 200000", "run scene.yaml -o out"), ("-v 200000", "sweep sweep.yaml -o swept"),
                               ("-v 400000", "--version")):
            with self.subTest(limit=limit, command=command):
                began = time.monotonic()
                done = self.under(limit, command, {"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"})
                self.assertLess(time.monotonic() - began, 10)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn(f"`ulimit {limit}` leaves OpenBLAS no room", done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertFalse((self.folder / "out").exists())
        # What the line advises suffices.
        least = re.search(r"raise the limit to (\d+) or more, or use fewer threads, as by OMP_NUM_THREADS=1", done.stderr)[1]
        done = self.under(f"-v {least}", "run scene.yaml -o out --threads 4")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_memory_that_a_limit_keeps_is_no_free_memory(self):
        self.write("fine.yaml", SCENE.replace("edge_mm: 2.6", "edge_mm: 0.35"))
        done = self.under("-v 1500000", "run fine.yaml -o out --set solve.solver=lu", {"OMP_NUM_THREADS": "1"})
        self.assertEqual(done.returncode, 2, done.stderr)
        free = float(re.search(r"([\d.]+) GiB are free", done.stderr)[1])
        self.assertLess(free, 1500000 / 2**20)

    def test_a_small_stack_is_said(self):
        done = self.under("-s 512", "--version")
        self.assertEqual(done.returncode, 1)
        self.assertIn("`ulimit -s 512` leaves too small a stack: raise the limit to 8192", done.stderr)

    def test_reading_needs_no_room_for_files(self):
        self.run_ok("run", "scene.yaml", "-o", "made", "--quiet")
        done = self.under("-f 1", "compare made made")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_processor_time_that_runs_out(self):
        self.write("long.yaml", SCENE.replace("edge_mm: 2.6", "edge_mm: 0.35").replace("solve:", "solve:\n  solver: matrix_free"))
        done = self.under("-t 2", "run long.yaml -o out", {"OMP_NUM_THREADS": "1"})
        self.assertEqual(done.returncode, 128 + 24, done.stderr)  # SIGXCPU
        self.assertIn("ulimit -t", done.stderr)
        self.assertIn("ulimit -t", json.loads((self.folder / "out.partial/failed.json").read_text())["reason"])
        # A sweep's process computes many cases: what ends it is no result of the one it was at.
        self.write("long_sweep.yaml", "base: long.yaml\ngrid: {array.level: [1, 0.9]}\n")
        done = self.under("-t 2", "sweep long_sweep.yaml -o swept --jobs 1", {"OMP_NUM_THREADS": "1"})
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"case [12]: its process reached the limit on processor time \(ulimit -t\); [01] of 2 cases are kept")

    def test_threads_of_variables_are_held_to_those_of_the_option(self):
        self.is_refused("run", "scene.yaml", "-o", "out", env={"OMP_NUM_THREADS": "4097"}, says="OMP_NUM_THREADS = '4097' must be 1 to 4096")
        self.assertFalse((self.folder / "out").exists())
        for setting in ({"OMP_NUM_THREADS": "100000", "OMP_THREAD_LIMIT": "2"}, {"OMP_NUM_THREADS": "x"}, {"OPENBLAS_NUM_THREADS": "100000"}):
            with self.subTest(setting):
                self.run_ok("run", "scene.yaml", "-o", "out", "--force", "--quiet", env=setting)

    def test_bound_threads_have_all_processors(self):
        own = sorted(os.sched_getaffinity(0))
        self.assertGreater(len(own), 1, "needs two processors")
        lists = {}
        for binding in ({"OMP_PROC_BIND": "master"}, {"GOMP_CPU_AFFINITY": str(own[0])}):
            with self.subTest(binding):
                said = self.run_ok("run", "scene.yaml", "-o", "out", "--force", "--quiet", env=binding | {"OMP_NUM_THREADS": "2"}).stderr
                self.assertRegex(said, "warning: 2 threads are bound to 1 processor: unset OMP_PROC_BIND")
        slow = self.write("slow.yaml", SCENE.replace("edge_mm: 2.6", "edge_mm: 0.6"))
        run = subprocess.Popen([PROGRAM, "run", slow, "-o", "slow", "--quiet"], cwd=self.folder, stderr=subprocess.DEVNULL,
                               env=os.environ | {"OMP_PROC_BIND": "true", "OMP_NUM_THREADS": str(len(own))})
        self.addCleanup(run.wait)
        self.addCleanup(run.kill)
        while run.poll() is None and not set(lists.values()) >= {(number,) for number in own}:
            for task in pathlib.Path(f"/proc/{run.pid}/task").iterdir():
                with contextlib.suppress(ProcessLookupError):  # it ended meanwhile
                    lists[task.name] = tuple(os.sched_getaffinity(int(task.name)))
            time.sleep(0.02)
        self.assertGreaterEqual(set(lists.values()), {(number,) for number in own})

    def test_a_core_runs_or_is_refused(self):
        for core in CORES:
            with self.subTest(core):
                done = self.touchfield("run", "scene.yaml", "-o", "out", "--force", env={"OPENBLAS_CORETYPE": core})
                if done.returncode != 0:
                    self.assertEqual(done.returncode, 2, done.stderr)
                    self.assertRegex(done.stderr, f"OPENBLAS_CORETYPE = '{core}' needs instructions of level v[34], which this processor lacks: unset it")


if __name__ == "__main__":
    unittest.main()
