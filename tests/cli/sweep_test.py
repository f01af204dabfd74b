"""Sweeps from end to end: what the cases are, that nothing is lost, that work is used again."""

import csv
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import time
import unittest

import h5py

from meshes import icosphere, write_ply
from support import PROGRAM, SOURCE, CommandTest

# A case takes some hundredths of a second.
TINY = """\
name: tiny
array:
  grid: {count: [4, 4], pitch_mm: 10.16}
body:
  sphere: {radius_mm: 6}
  place: {at_mm: [0, 0, 60]}
  edge_mm: 3
target:
  box: {at: nearest_array, size_mm: [8, 8, 8]}
  pressure_pa: 100
solve:
  methods: [focus, paper]
  iterations: 4
  scheme: paper_corrected
  resonance_check: never
evaluation: none
write: [h5]
"""
KILLS = int(os.environ.get("TOUCHFIELD_KILLS", "10"))
SEED = int(os.environ.get("TOUCHFIELD_SEED", "11"))
SECONDS = {"seconds", "seconds_solve", "seconds_total"}


def table(directory):
    with open(directory / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


class SweepTest(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", TINY)
        self.write("tiny.stl", "no mesh")

    def sweep(self, name, text):
        return self.write(name, "base: tiny.yaml\n" + text)

    def start(self, *arguments):
        return subprocess.Popen([PROGRAM, "sweep", *map(str, arguments)], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def same_tables(self, a, b):
        """Inputs equal as texts, results to rounding."""
        self.assertEqual(len(a), len(b))
        for left, right in zip(a, b):
            self.assertEqual(left.keys(), right.keys())
            for key in left.keys() - SECONDS:
                try:
                    x, y = float(left[key]), float(right[key])
                except ValueError:
                    self.assertEqual(left[key], right[key], key)
                    continue
                # The body's own frame is reached by a rotation and a shift: rounding of the coordinates only.
                self.assertTrue(x == y or (math.isnan(x) and math.isnan(y)) or abs(x - y) <= 1e-8 * max(abs(x), abs(y)),
                                f"case {left['case']} {key}: {x} {y}")

    def end_of(self, *arguments):
        return json.loads(self.run_ok("sweep", *arguments, "--json").stdout.splitlines()[-1])

    # What the cases are

    def test_a_grid_is_every_combination(self):
        self.sweep("s.yaml", "grid: {'body.place.at_mm[2]': [60, 70], target.pressure_pa: [100, 2.5e2]}\n")
        lines = [json.loads(line) for line in self.run_ok("sweep", "s.yaml", "-o", "out", "--json").stdout.splitlines()]
        self.assertEqual([line["event"] for line in lines], ["case"] * 4 + ["end"])
        self.assertEqual([line["done"] for line in lines], [1, 2, 3, 4, 4])
        self.assertGreaterEqual(lines[0]["seconds_left"], 0)
        rows = [row for row in table(self.folder / "out") if row["name"] == "focus"]
        self.assertEqual([(row["case"], row["body.place.at_mm[2]"], row["target.pressure_pa"]) for row in rows],
                         [("1", "60", "100"), ("2", "60", "2.5e2"), ("3", "70", "100"), ("4", "70", "2.5e2")])
        self.assertEqual(lines[1]["methods"][0]["metrics"]["relative_error"], float(rows[1]["relative_error"]))
        for row in rows:
            with h5py.File(self.folder / f"out/cases/{int(row['case']):05d}/run.h5") as run:
                self.assertEqual(run.attrs["complete"], 1)
                self.assertIn(f"pressure_pa: {float(row['target.pressure_pa']):g}", run["scene"][()].decode())

    def test_zip_lists_and_draws_combine(self):
        text = ("zip: {array.level: [0.5, 1], medium.temperature_c: [10, 30]}\n"
                "cases: [{solve.methods: [focus]}, {solve.methods: [paper], target.pressure_pa: 50}]\n"
                "random: {count: 3, seed: 7, ranges: {'body.place.at_mm[0]': [-2, 2], solve.outside_weight: {log: [0.1, 10]}, "
                "'body.place.at_mm[1]': {normal: [0, 1]}, solve.max_steps: {integer: [50, 60]}}}\n")
        self.sweep("s.yaml", text)
        inputs = [case["inputs"] for case in self.listed("s.yaml")]
        self.assertEqual([row["array.level"] for row in inputs], ["0.5"] * 6 + ["1"] * 6)
        self.assertEqual([row["medium.temperature_c"] for row in inputs], ["10"] * 6 + ["30"] * 6)
        self.assertEqual([row.get("target.pressure_pa") for row in inputs], ([None] * 3 + ["50"] * 3) * 2)
        keys = ["body.place.at_mm[0]", "solve.outside_weight", "body.place.at_mm[1]", "solve.max_steps"]
        draws = [[row[key] for key in keys] for row in inputs]
        self.assertEqual(draws, draws[:3] * 4)
        self.assertEqual(len({tuple(draw) for draw in draws}), 3)
        for x, weight, _, steps in draws[:3]:
            self.assertTrue(-2 <= float(x) < 2 and 0.1 <= float(weight) < 10 and 50 <= int(steps) <= 60)
        # A longer draw begins with the shorter one.
        self.sweep("longer.yaml", text.replace("count: 3", "count: 5"))
        self.assertEqual([[case["inputs"][key] for key in keys] for case in self.listed("longer.yaml")[:3]], draws[:3])

    def test_bad_sweeps_are_refused_before_anything_is_written(self):
        cases = {
            "grid: {target.presure_pa: [1, 2]}\n": "case 1: target.presure_pa=1",
            "gird: {target.pressure_pa: [3]}\n": "gird: unknown key, did you mean grid?",
            "zip: {a: [1, 2], b: [1]}\n": "zip.b: 1 values, must be as many as the first list has, 2",
            "grid: {body: [1]}\nzip: {body.place: [2]}\n": "zip.body.place: grid changes body, one of which is part",
            "random: {count: 1, seed: 1, ranges: {a: [2, 1]}}\n": "random.ranges.a: must have low <= high",
            "set: {solve.iterations: 3}\n": "nothing varies",
            # Files that scenes name.
            "cases: [{'solve.start': {previous: tiny.yaml}}]\n": "case 1: start of paper: .*tiny.yaml: is not an HDF5 file",
            "set: {body.sphere: null, body.edge_mm: null}\n"
            "cases: [{body.mesh: {file: tiny.stl, unit: mm}}]\n": "case 1: .*tiny.stl",
            "cases: [{solve.methods: [{fixed: {phases_rad: [0, 1]}}]}]\n": "case 1: solve.methods: fixed has 2 phases",
            "grid: [1, 2\n": "s.yaml:3:1"}
        for text, message in cases.items():
            with self.subTest(text=text):
                self.sweep("s.yaml", text)
                before = self.entries()
                done = self.is_refused("sweep", "s.yaml", "-o", "out")
                self.assertRegex(done.stderr, message if ".*" in message else re.escape(message))
                self.assertEqual(self.entries(), before)
        self.write("nobase.yaml", "grid: {a: [1]}\n")
        self.sweep("s.yaml", "grid: {target.pressure_pa: [1, 2]}\n")
        for arguments, says in [(["s.yaml", "--plot", "beauty"], "metric beauty: unknown"), (["missing.yaml"], "missing.yaml: no such file"),
                                (["nobase.yaml"], "base: missing"), (["s.yaml", "-o", "out", "--case", "1-2x"], "must be a number, or FIRST-LAST"),
                                (["s.yaml", "-o", "out", "--case", "3"], "case 3-3: the sweep has cases 1 to 2"),
                                (["s.yaml", "--case", 1], "-o DIR"),
                                (["s.yaml", "-o", "tiny.stl"], "in the way"), (["s.yaml", "-o", "/proc/out"], "/proc/out cannot be made")]:
            self.is_refused("sweep", *arguments, says=says)
        self.assertFalse((self.folder / "results").exists())

    # Nothing is lost

    def test_processes_that_are_killed_at_random_lose_nothing(self):
        """Four processes of one sweep, of which one is killed and started again, many times."""
        kills = KILLS
        cases = max(10, kills // 2)
        self.sweep("s.yaml", "set: {solve.methods: [focus]}\ngrid: {target.pressure_pa: [100, 200, 300, 400]}\n"
                   f"random: {{count: {cases}, seed: 3, ranges: {{'body.place.at_mm[0]': [-5, 5], "
                   "'body.sphere.radius_mm': {integer: [5, 6]}}}\n")
        cases *= 4
        chance = random.Random(SEED)
        folder = self.folder / "broken/cases"
        going = [None] * 4
        computed = {}
        killed = 0
        while killed < kills:
            for place, process in enumerate(going):
                if process is None or process.poll() is not None:
                    self.assertIn(process and process.wait(), (None, 0))
                    going[place] = subprocess.Popen([PROGRAM, "sweep", "s.yaml", "-o", "broken", "--quiet", "--jobs", str(1 + place % 2),
                                                     "--threads", "1"], cwd=self.folder, stdout=subprocess.DEVNULL)
            time.sleep(chance.uniform(0.05, 0.4))
            victim = chance.randrange(4)
            going[victim].kill()
            killed += going[victim].wait() == -signal.SIGKILL
            going[victim] = None
            done = {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("0*/case.json")}
            for name, when in computed.items():
                self.assertEqual(done.get(name), when, f"case {name} was lost, or computed again")
            computed = done
            if len(done) == cases:  # before all kills: begin again, with some cases left out
                for name in sorted(done)[chance.randrange(10):]:
                    shutil.rmtree(folder / name, ignore_errors=True)
                    del computed[name]
        for process in going:
            if process is not None:
                process.kill()
                process.wait()
        done = self.run_ok("sweep", "s.yaml", "-o", "broken", "--json")
        end = json.loads(done.stdout.splitlines()[-1])
        self.assertEqual((end["cases"], end["done"], end["failed"]), (cases, cases, 0))
        self.assertNotIn("damaged", done.stderr)
        self.assertEqual([row["case"] for row in table(self.folder / "broken")], [str(i) for i in range(1, cases + 1)])
        self.assertEqual(sorted(path.name for path in folder.iterdir()), [f"{i:05d}" for i in range(1, cases + 1)])
        self.run_ok("sweep", "s.yaml", "-o", "whole", "--quiet")
        self.same_tables(table(self.folder / "whole"), table(self.folder / "broken"))

    def test_a_damaged_case_is_named_and_computed_again(self):
        self.sweep("s.yaml", "set: {solve.methods: [focus]}\ngrid: {array.level: [1, 0.9, 0.8]}\n")
        self.run_ok("sweep", "s.yaml", "-o", "out")
        good = table(self.folder / "out")
        case = self.folder / "out/cases/00002"

        def changed(name, change):
            content = (case / name).read_bytes()
            self.assertNotEqual(change(content), content)
            (case / name).write_bytes(change(content))

        def flipped(content):
            middle = len(content) // 2
            return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1:]

        damages = [
            ("run.h5: No such file or directory", lambda: (case / "run.h5").unlink()),
            ("case.json: no such file", lambda: (case / "case.json").unlink()),
            ("run.h5: has ", lambda: changed("run.h5", lambda content: content[:1000])),
            ("run.h5: its checksum has changed", lambda: changed("run.h5", flipped)),
            ("case.json: not the record of a case", lambda: changed("case.json", lambda content: content[:50])),
            ("case.json: its checksum has changed",
             lambda: changed("case.json", lambda content: content.replace(b'"faces": ', b'"faces": 1'))),
            ("case.json: a pipe, must be a file", lambda: ((case / "case.json").unlink(), os.mkfifo(case / "case.json"))),
            ("case.json: is the record of case 3",
             lambda: shutil.copytree(self.folder / "out/cases/00003", case, dirs_exist_ok=True)),
        ]
        for message, damage in damages:
            with self.subTest(message=message):
                damage()
                again = self.run_ok("sweep", "s.yaml", "-o", "out", "--json")
                self.assertRegex(again.stderr, f"warning: case 2 is damaged and computed again: .*{message}")
                self.assertEqual(json.loads(again.stdout.splitlines()[-1])["computed"], 1)
                self.same_tables(good, table(self.folder / "out"))

    def test_a_changed_sweep_is_not_mixed_in(self):
        tiny = TINY.replace("sphere: {radius_mm: 6}", "mesh: {file: a.ply, unit: mm}").replace("  edge_mm: 3\n", "")
        sweep = "grid: {target.pressure_pa: [100, 200]}\n"

        def written(sweep=sweep, scene=tiny, radius=6):
            write_ply(self.folder / "a.ply", *icosphere(2, radius))
            self.write("tiny.yaml", scene)
            self.sweep("s.yaml", sweep)

        written()
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet")
        before = (self.folder / "out/sweep.json").read_text()
        for name, change, more in [("set", {}, ("--set", "solve.iterations=9")),
                                   ("values", {"sweep": sweep.replace("200", "201")}, ()),
                                   ("cases", {"sweep": sweep.replace("200", "200, 300")}, ()),
                                   ("scene", {"scene": tiny.replace("iterations: 4", "iterations: 5")}, ()),
                                   ("mesh", {"radius": 6.1}, ())]:
            with self.subTest(name=name):
                written(**change)
                self.is_refused("sweep", "s.yaml", "-o", "out", *more, says="out/sweep.json is not of s.yaml as it is now")
                self.assertEqual((self.folder / "out/sweep.json").read_text(), before)
        written(scene=tiny + "# a remark changes nothing\n")
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet")

    def test_a_failed_case_is_recorded_and_the_rest_go_on(self):
        # At 5 mm the sphere reaches through the array: found only when the scene is built. GMRES needs more than 1 step.
        self.sweep("s.yaml", "set: {solve.solver: gmres}\n"
                   "cases: [{solve.max_steps: 400}, {'body.place.at_mm[2]': 5}, {solve.max_steps: 1}, {array.level: 0.9}]\n")
        done = self.is_refused("sweep", "s.yaml", "-o", "out", code=1)
        self.assertIn("4 of 4 cases done, 2 failed", done.stdout)
        self.assertRegex(done.stderr, r"case 2 \(body\.place\.at_mm\[2\]=5\) failed: array: ")
        self.assertRegex(done.stderr, "case 3 .*scheme paper_corrected by GMRES, stored .* use the scheme burton_miller_polished")
        rows = table(self.folder / "out")
        self.assertEqual([row["status"] for row in rows], ["ok", "ok", "failed", "failed", "ok", "ok"])
        self.assertIn("array: ", rows[2]["reason"])
        self.assertEqual(rows[2]["relative_error"], "nan")
        again = self.touchfield("sweep", "s.yaml", "-o", "out", "--json")
        self.assertEqual(again.returncode, 1)
        self.assertEqual(json.loads(again.stdout.splitlines()[-1])["computed"], 0)
        mine = self.write("out/cases/00002/notes.txt", "mine")
        retried = self.is_refused("sweep", "s.yaml", "-o", "out", "--case", 2, "--json", code=1)
        self.assertEqual(json.loads(retried.stdout.splitlines()[-1])["computed"], 1)
        self.assertEqual(mine.read_text(), "mine")

    def workers(self, pid):
        found = []
        for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                name_and_rest = stat.read_text().rpartition(")")[2].split()
            except (FileNotFoundError, ProcessLookupError):
                continue  # it has ended meanwhile
            if int(name_and_rest[1]) == pid:
                found.append(int(stat.parent.name))
        return found

    def wait_for(self, what, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            result = what()
            if result:
                return result
            time.sleep(0.01)
        self.fail("waited in vain")

    def test_an_interrupt_keeps_what_is_done_and_says_how_to_go_on(self):
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9, 0.8, 0.7, 0.6, 0.5]}\nset: {solve.iterations: 3000}\n")
        for number, signum in enumerate([signal.SIGINT, signal.SIGTERM]):
            going = self.start("s.yaml", "-o", f"out{number}")
            self.wait_for(lambda: (self.folder / f"out{number}/cases/00001").exists())
            worker = self.workers(going.pid)
            going.send_signal(signum)
            _, err = going.communicate(timeout=60)
            self.assertEqual(going.returncode, 128 + signum, err)
            self.assertIn(f"the same command with -o out{number} continues", err)
            self.assertEqual([pid for pid in worker if pathlib.Path(f"/proc/{pid}").exists()], [])
            done = [path.name for path in (self.folder / f"out{number}/cases").iterdir() if not path.name.endswith(".lock")]
            self.assertTrue(all(re.fullmatch(r"\d{5}", name) for name in done), done)
            self.assertEqual(len({row["case"] for row in table(self.folder / f"out{number}")}), len(done))
        self.run_ok("sweep", "s.yaml", "-o", "out0", "--quiet")
        self.assertEqual(len(table(self.folder / "out0")), 12)

    def test_workers_die_with_their_owner(self):
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9]}\nset: {body.edge_mm: 0.5}\n")
        going = self.start("s.yaml", "-o", "out")
        worker = self.wait_for(lambda: self.workers(going.pid))[0]
        going.kill()
        going.communicate()
        self.wait_for(lambda: not pathlib.Path(f"/proc/{worker}").exists() or
                      "State:\tZ" in pathlib.Path(f"/proc/{worker}/status").read_text())

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_without_locks_cases_are_named(self):
        source = self.write("none.c", "#include <errno.h>\nint flock(int file, int how) { (void)file; (void)how; errno = ENOLCK; return -1; }\n")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", self.folder / "none.so", source], check=True)
        none = {"LD_PRELOAD": str(self.folder / "none.so")}
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9, 0.8]}\n")
        self.is_refused("sweep", "s.yaml", "-o", "out", env=none, says="its file system has no locks; give a folder of another one with "
                        "-o, or give each process its own cases with --case FIRST-LAST, which takes no locks")
        self.assertEqual(list((self.folder / "out/cases").iterdir()), [])
        for cases in ("1-2", "3"):
            self.run_ok("sweep", "s.yaml", "-o", "out", "--case", cases, "--quiet", env=none)
        self.assertFalse((self.folder / "out/sweep.csv").exists())
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet", env=none)  # the table
        self.assertEqual([row["case"] for row in table(self.folder / "out")], ["1", "1", "2", "2", "3", "3"])

    def test_a_folder_of_others_stays_as_it_is(self):
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9]}\n")
        for name in ("sweep.csv", "sweep.log", "sweep_relative_error.png", "cases/00001/run.h5", "cases/notes"):
            path = self.folder / "out" / name
            path.parent.mkdir(parents=True)
            path.write_text("mine")
            before = sorted(self.folder.rglob("*"))
            for more in ([], ["--case", 1]):
                self.is_refused("sweep", "s.yaml", "-o", "out", *more, says=f"output directory out: its {name.split('/')[0]} is of another sweep")
            self.assertEqual(sorted(self.folder.rglob("*")), before)
            self.assertEqual(path.read_text(), "mine")
            shutil.rmtree(self.folder / "out")
        self.is_refused("sweep", "s.yaml", "-o", "out", "--case", 3, says="the sweep has cases 1 to 2")
        self.assertFalse((self.folder / "out").exists())
        (self.folder / "out/cases").mkdir(parents=True)
        self.write("out/sweep_plan.yaml", "mine")
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet")

    def test_a_damaged_case_that_cannot_be_replaced_is_named_and_passed_over(self):
        self.sweep("s.yaml", "set: {solve.methods: [focus]}\ngrid: {array.level: [1, 0.9, 0.8]}\n")
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet")
        good = table(self.folder / "out")
        case = self.folder / "out/cases/00002"

        (case / "run.h5").unlink()
        (case / "run.h5").mkdir()
        (case / "run.h5/precious").write_text("mine")
        shutil.rmtree(self.folder / "out/cases/00003")
        done = self.is_refused("sweep", "s.yaml", "-o", "out", "--json", code=1)
        self.assertRegex(done.stderr, "case 2 .*failed: out/cases/00002 cannot be replaced: .*; remove it, and the same command")
        end = json.loads(done.stdout.splitlines()[-1])
        self.assertEqual((end["done"], end["failed"], end["computed"]), (3, 1, 2))
        self.assertEqual([row["status"] for row in table(self.folder / "out")], ["ok", "failed", "ok"])
        self.assertEqual((case / "run.h5/precious").read_text(), "mine")
        shutil.rmtree(case)
        self.run_ok("sweep", "s.yaml", "-o", "out", "--quiet")
        self.same_tables(good, table(self.folder / "out"))

    def test_a_full_disk_keeps_what_is_finished(self):
        disk = self.folder / "disk"
        disk.mkdir()
        mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", disk], capture_output=True,
                               check=False)
        if mount.returncode != 0:
            self.skipTest("no right to mount a small disk here")
        self.addCleanup(subprocess.run, ["umount", disk], check=False)
        self.sweep("s.yaml", f"grid: {{array.level: {[round(1 - 0.005 * i, 3) for i in range(60)]}}}\n")
        done = self.is_refused("sweep", "s.yaml", "-o", disk / "out", code=1)
        self.assertIn("No space left on device", done.stderr)
        whole = sorted((disk / "out/cases").glob("0*"))
        self.assertGreater(len(whole), 0)
        self.assertIn(f"{len(whole)} of 60 cases are kept in {disk}/out, the same command continues from there", done.stderr)
        for case in whole:
            self.assertEqual(json.loads((case / "case.json").read_text())["status"], "ok")
            with h5py.File(case / "run.h5") as run:
                self.assertEqual(run.attrs["complete"], 1)
        subprocess.run(["mount", "-o", "remount,size=40m", disk], check=True)
        self.assertEqual(self.end_of("s.yaml", "-o", disk / "out")["computed"], 60 - len(whole))
        self.assertEqual({row["status"] for row in table(disk / "out")}, {"ok"})

    # Several machines

    def listed(self, *arguments):
        return [json.loads(line) for line in self.run_ok("sweep", *arguments, "--list", "--json").stdout.splitlines()]

    def test_the_list_has_every_case_and_what_it_takes(self):
        self.sweep("s.yaml", "grid: {body.edge_mm: [3, 1.5], 'body.place.at_mm[2]': [60, 5], name: [a, b]}\n")
        before = self.entries()
        cases = self.listed("s.yaml")
        self.assertEqual(self.entries(), before)
        self.assertEqual([case["case"] for case in cases], list(range(1, 9)))
        self.assertEqual([case["name"] for case in cases], ["a", "b"] * 4)
        self.assertEqual(cases[2]["inputs"], {"body.edge_mm": "3", "body.place.at_mm[2]": "5", "name": "a"})
        built = [case for case in cases if case["inputs"]["body.place.at_mm[2]"] == "60"]
        for case in built:
            self.assertGreater(case["seconds"], 0)
            self.assertGreater(case["memory_mib"], 0)
            self.assertEqual((case["channels"], case["reason"]), (16, ""))
        self.assertGreater(built[2]["faces"], 2 * built[0]["faces"])
        for case in cases:
            if case not in built:  # the sphere reaches through the array
                self.assertIsNone(case["seconds"])
                self.assertIn("array: ", case["reason"])

    def test_cases_in_any_order_by_several_processes_are_the_sweep(self):
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9, 0.8], body.place: [{at_mm: [0, 0, 60]}, {at_mm: [2, 1, 63], rotate_deg: [10, 20, 30]}]}\n")
        self.run_ok("sweep", "s.yaml", "-o", "whole", "--quiet", "--threads", 1, "--jobs", 1)
        numbers = [case["case"] for case in self.listed("s.yaml")]
        random.Random(5).shuffle(numbers)
        going = [self.start("s.yaml", "-o", "parts", "--case", number, "--threads", 1, "--quiet") for number in numbers[:4]]
        for process in going:
            _, err = process.communicate(timeout=300)
            self.assertEqual(process.returncode, 0, err)
        for number in numbers[4:5] * 2:  # one that is whole is not computed again
            last = self.end_of("s.yaml", "-o", "parts", "--case", f"{number:05d}", "--threads", 1)
        self.assertEqual(last["computed"], 0)
        (self.folder / f"parts/cases/{numbers[5]:05d}").mkdir()  # as a scheduler makes the folders of outputs
        written = {path: path.stat().st_mtime_ns for path in (self.folder / "parts/cases").rglob("run.h5")}
        self.assertEqual(len(written), 5)
        done = self.run_ok("sweep", "s.yaml", "-o", "parts", "--threads", 1, "--json")
        self.assertNotIn("damaged", done.stderr)
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["computed"], 1)
        self.assertEqual({path: path.stat().st_mtime_ns for path in written}, written)
        self.same_to_the_byte("whole", "parts")

    def same_to_the_byte(self, one, other):
        """Tables but for times, and pictures."""
        bare = [[{key: value for key, value in row.items() if key not in SECONDS} for row in table(self.folder / name)]
                for name in (one, other)]
        self.assertEqual(bare[0], bare[1])
        pictures = [(self.folder / name / "sweep_relative_error.png").read_bytes() for name in (one, other)]
        self.assertEqual(pictures[0], pictures[1])

    def test_schedulers_run_the_cases(self):
        """The tasks of a job array as Slurm starts them, and Snakemake where it is installed."""
        self.sweep("s.yaml", "grid: {array.level: [1, 0.9, 0.8]}\n")
        self.run_ok("sweep", "s.yaml", "-o", "whole", "--quiet", "--threads", 1, "--jobs", 1)
        started = [subprocess.Popen([SOURCE / "scripts/sweep.slurm", "s.yaml", "".join(["array", *how]), *how, "--quiet"],
                                    cwd=self.folder, env=os.environ | {"TOUCHFIELD": PROGRAM, "SLURM_ARRAY_TASK_ID": str(task)})
                   for how in ([], ["--by-case"]) for task in (1, 2, 3)]
        self.assertEqual([process.wait(300) for process in started], [0] * 6)
        outs = ["array", "array--by-case"]
        self.assertEqual(self.end_of("s.yaml", "-o", outs[1])["computed"], 0)  # the table
        if shutil.which("snakemake"):
            outs.append("parts")
            subprocess.run(["snakemake", "--snakefile", SOURCE / "examples/Snakefile", "--cores", "2", "--config", "sweep=s.yaml",
                            "out=parts", f"program={PROGRAM}"], cwd=self.folder, timeout=300, check=True)
        for out in outs:
            self.same_to_the_byte("whole", out)

    # Work is used again

    def test_cases_that_share_a_factorisation_are_runs_of_their_own(self):
        self.sweep("s.yaml", "set: {solve.solver: lu, evaluation: {scheme: paper_corrected, split: 1}}\ncases:\n"
                   "  - {array.level: 0.9}\n"
                   "  - {'body.place.at_mm': [3, 4, 70]}\n"
                   "  - {body.place.rotate_deg: [0, 0, 30]}\n"
                   "  - {array.at_mm: [5, 0, -10]}\n"
                   "  - {medium.temperature_c: 25}\n"
                   "  - {frequency_khz: 41}\n"
                   "  - {body.sphere.radius_mm: 6.5}\n"
                   "  - {solve.scheme: paper}\n")
        self.assertEqual([case["sharing"] for case in self.listed("s.yaml")], [4, 4, 4, 4, 1, 1, 1, 1])
        self.run_ok("sweep", "s.yaml", "-o", "out", "--jobs", 1, "--quiet")
        for row in [row for row in table(self.folder / "out") if row["name"] == "paper"]:
            self.run_ok("run", "--from", f"out/cases/{int(row['case']):05d}/run.h5", "-o", f"one{row['case']}", "--quiet")
            with open(self.folder / f"one{row['case']}/metrics.csv", newline="") as file:
                alone = next(line for line in csv.DictReader(file) if line["name"] == "paper")
            # A rotation and a shift of the mesh: rounding, of which the condition of B makes some ten times as much.
            for name in ("relative_error", "leakage", "force_target_n", "evaluation_difference", "peak_pa"):
                self.assertAlmostEqual(float(row[name]) / float(alone[name]), 1.0, delta=1e-8, msg=name)


if __name__ == "__main__":
    unittest.main()
