"""Runs from end to end: what lands, what repeats, what an interruption leaves."""

import base64
import json
import os
import pathlib
import re
import signal
import subprocess
import time
import unittest

import h5py
import numpy

from support import FINGER, PROGRAM, CommandTest, open_run, rows_of


class RunTest(CommandTest):
    def test_everything_asked_for_lands(self):
        scene = self.write("scene.yaml", FINGER + "field: [{name: side, plane: xz, through_mm: [0, 0, 60],"
                           " size_mm: [30, 40], spacing_mm: 2}]\n")
        printed = json.loads(self.run_ok("run", scene, "-o", "out", "--json").stdout)
        names = {path.name for path in (self.folder / "out").iterdir()}
        self.assertEqual(names, {"run.h5", "surface.vtp", "array.vtp", "side.vti", "run.vtm", "metrics.csv", "run.log",
                                 "files.json"})
        self.assertEqual([method["name"] for method in printed["methods"]], ["paper", "unscattered", "focus", "fixed"])
        self.assertIsNone(printed["methods"][0]["optimality_gap"])
        info = json.loads(self.run_ok("info", "out", "--json").stdout)
        self.assertEqual(info["methods"][0]["relative_error"], printed["methods"][0]["relative_error"])
        self.assertIn("paper", self.run_ok("info", "out/run.h5").stdout)
        self.assertEqual(json.loads(self.run_ok("check", scene, "--json").stdout)["faces"], printed["faces"])
        with open_run(self.folder / "out") as run:
            self.assertEqual(run.attrs["complete"], 1)
            area, target = run["mesh/area"][:], run["target/face"][:]
            self.assertEqual(run["methods/paper/cost"].shape, (9,))
            self.assertTrue(numpy.all(numpy.diff(run["methods/paper/cost"][:]) <= 0))
            inside = area[target] * run["target/share"][:]
            self.assertLess(run["methods/paper"].attrs["relative_error"], run["methods/fixed"].attrs["relative_error"])
            # No phases give a larger pressure on the central face than those that are in phase there.
            corners = run["mesh/vertices"][:][run["mesh/triangles"][:]].mean(axis=1)[target]
            centre = numpy.sum(corners * inside[:, None], axis=0) / inside.sum()
            central = target[numpy.argmin(numpy.linalg.norm(corners - centre, axis=1))]
            peak = {name: abs(method["pressure"][central]) for name, method in run["methods"].items()}
            self.assertEqual(max(peak, key=peak.get), "focus")
            field = run["field/side/pressure/paper"][:]
            inside = run["field/side/inside"][:].astype(bool)
            self.assertTrue(inside.any() and not inside.all())
            self.assertTrue(numpy.all(field[inside] == 0) and numpy.all(field[~inside] != 0))
        self.assertEqual([row["name"] for row in rows_of(self.folder / "out/metrics.csv")], ["paper", "unscattered", "focus", "fixed"])

    def test_the_report_names_files_that_are_there_and_its_scene_repeats_the_run(self):
        text = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[focus]")
        scene = self.write("scene.yaml", text.replace("write: [h5, vtp, vti]", "write: [h5, png]"))
        done = self.run_ok("run", scene, "-o", "out")
        self.assertIn("open out/report.html", done.stderr)
        report = (self.folder / "out/report.html").read_text()
        named = set(re.findall(r'(?:src|href)="([^"]*)"', report))
        picture, = [name for name in named if name.startswith("data:")]
        self.assertEqual(base64.b64decode(picture.partition(",")[2]), (self.folder / "out/overview.png").read_bytes())
        self.assertEqual(named, {picture})
        for part in ["Phase conjugation", "10.1007/978-3-030-58147-3_45", "triangular faces"]:
            self.assertIn(part, report)
        self.run_ok("run", "out/scene.yaml", "-o", "again", "--set", "write=[h5]")
        with open_run(self.folder / "out") as a, open_run(self.folder / "again") as b:
            numpy.testing.assert_array_equal(a["methods/focus/pressure"][:], b["methods/focus/pressure"][:])
        self.assertFalse((self.folder / "again/report.html").exists())

    def test_view_opens_the_page_of_a_result(self):
        self.write_samples()
        self.assertEqual(self.run_ok("view", "run.h5", "-o", "page.html").stdout, "page in page.html\n")
        self.assertIn('<section id="view">', (self.folder / "page.html").read_text())
        self.is_refused("view", "run.h5", "-o", "run.h5", "--force", says="run.h5")
        self.is_refused("view", "run.h5", "-o", "page.html", says="--force")
        desktop = self.write("xdg-open", "#!/bin/sh\ncp \"$1\" opened.html\n")
        desktop.chmod(0o755)
        self.run_ok("view", "run.h5", env={"PATH": f"{self.folder}:{os.environ['PATH']}", "TMPDIR": str(self.folder)})
        page, = self.folder.glob("touchfield-*.html")
        for _ in range(100):
            if (self.folder / "opened.html").exists():
                break
            time.sleep(0.05)
        self.assertEqual((self.folder / "opened.html").read_text(), page.read_text())
        done = self.run_ok("view", "run.h5", env={"PATH": "/nowhere", "TMPDIR": str(self.folder)})
        self.assertIn("xdg-open is not there", done.stdout)

    def test_twice_in_a_row_without_an_output(self):
        scene = self.write("scene.yaml", FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[focus]"))
        for _ in range(2):
            self.assertEqual(self.run_ok("run", scene, "--quiet").stderr, "")
        runs = sorted(path.name for path in (self.folder / "results/runs").iterdir())
        self.assertEqual(runs, ["finger-0001", "finger-0002"])

    def test_threads_change_nothing(self):
        scene = self.write("scene.yaml", FINGER)
        for threads in [1, 3]:
            self.run_ok("run", scene, "-o", f"out{threads}", "--threads", threads)
        with open_run(self.folder / "out1") as one, open_run(self.folder / "out3") as other:
            for name in one["methods"]:
                a, b = one[f"methods/{name}"], other[f"methods/{name}"]
                # Polishing rounds to single precision, where the last bit of a sum in double can tip a value.
                numpy.testing.assert_allclose(numpy.abs(b["pressure"][:]), numpy.abs(a["pressure"][:]), rtol=3e-6)
                for metric in ["relative_error", "leakage", "width_mm", "force_target_n", "cost"]:
                    numpy.testing.assert_allclose(b.attrs[metric], a.attrs[metric], rtol=1e-7)

    def start(self, scene, out):
        return subprocess.Popen([PROGRAM, "run", str(scene), "-o", out], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def slow_scene(self):
        # Seconds of optimisation after a first method that lands at once.
        text = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[focus, paper, unscattered]")
        return self.write("slow.yaml", text.replace("[8, 8]", "[24, 24]").replace("iterations: 8", "iterations: 2000"))

    def wait_for(self, path, process):
        while not path.exists():
            self.assertIsNone(process.poll(), "the run ended before it could be interrupted")
            time.sleep(0.01)

    def test_kill_while_files_are_written(self):
        # Thousands of writes: a scene of many quick methods, killed at many moments.
        methods = ", ".join(f"{{fixed: {{as: m{i}, phases_rad: {i}}}}}" for i in range(40))
        scene = self.write("many.yaml", FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", f"[{methods}]"))
        out = self.folder / "out.partial"
        seen = set()
        for step in range(6):
            process = self.start(scene, "out")
            self.wait_for(out / "run.h5", process)
            while self.check_whole(out) < 5 * step:
                self.assertIsNone(process.poll(), "the run ended before it could be killed")
                time.sleep(0.002)
            time.sleep(0.002 * step)
            process.kill()
            process.communicate()
            seen.add(self.check_whole(out))
            for path in out.iterdir():
                path.unlink()
        self.assertGreater(len(seen), 1, "every kill hit the same moment")

    def check_whole(self, out: pathlib.Path):
        """Every named file is complete; returns the number of methods that landed."""
        methods = 0
        for path in out.iterdir():
            if path.name == "run.h5":
                with h5py.File(path, "r") as run:
                    methods = len(run["methods"])
                    for method in run["methods"].values():
                        self.assertTrue(numpy.all(numpy.isfinite(method["pressure"][:])))
            elif path.name == "metrics.csv":
                lines = path.read_text().splitlines()
                self.assertTrue(all(line.count(",") == lines[0].count(",") for line in lines))
            elif not path.name.startswith("."):
                self.assertIn(path.name, ["run.log", "files.json"])
        return methods

    def test_interrupt_says_what_is_missing(self):
        for number, name in [(signal.SIGINT, "SIGINT"), (signal.SIGTERM, "SIGTERM")]:
            out = self.folder / f"out{name}.partial"
            process = self.start(self.slow_scene(), out.stem)
            self.wait_for(out / "run.h5", process)
            time.sleep(0.3)  # from the file's appearance to the note that it is there; the next method takes seconds
            process.send_signal(number)
            began = time.monotonic()
            _, said = process.communicate()
            self.assertLess(time.monotonic() - began, 5)
            self.assertEqual(process.returncode, 128 + number)
            self.assertIn(f"{out.name}/failed.json", said)
            self.assertFalse((self.folder / out.stem).exists())
            record = json.loads((out / "failed.json").read_text())
            self.assertIn(name, record["reason"])
            self.assertEqual(record["finished_methods"], ["focus"])
            self.assertEqual(record["missing_methods"], ["paper", "unscattered"])
            with open_run(out) as run:
                self.assertEqual(list(run["methods"]), ["focus"])
                self.assertEqual(run.attrs["complete"], 0)

    def test_a_disk_that_fills_up_is_recorded(self):
        # A file size limit stands for a full disk: the small record still fits.
        scene = self.write("scene.yaml", FINGER)
        done = subprocess.run(["bash", "-c", f"ulimit -f 8; exec {PROGRAM} run {scene} -o out"],
                              cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("run.h5", done.stderr)
        record = json.loads((self.folder / "out.partial/failed.json").read_text())
        self.assertIn("run.h5", record["reason"])
        self.assertIn("what is finished is in out.partial", done.stderr)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
