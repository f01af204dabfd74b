"""Runs from end to end: what lands, what repeats, what an interruption leaves."""

import base64
import csv
import json
import math
import os
import pathlib
import re
import signal
import subprocess
import time
import unittest

import h5py
import numpy

from support import FINGER, PROGRAM, CommandTest, open_run


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
            inside, wanted = area[target] * run["target/share"][:], run["target/amplitude"][:]
            for method in run["methods"].values():
                # relative_error and leakage anew, from the pressures alone
                p = numpy.abs(method["pressure"][:])
                energy, least = numpy.sum(area * p**2), numpy.sum(inside * wanted**2)
                error = numpy.sqrt(1 - numpy.sum(inside * p[target] * wanted) ** 2 / (energy * least))
                self.assertAlmostEqual(method.attrs["relative_error"], error, places=10)
                leakage = 1 - numpy.sum(inside * p[target] ** 2) / energy
                self.assertAlmostEqual(method.attrs["leakage"], leakage, places=10)
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
        with open(self.folder / "out/metrics.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["name"] for row in rows], ["paper", "unscattered", "focus", "fixed"])
        self.assertTrue(math.isnan(float(rows[0]["optimality_gap"])))

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

    def test_levels_at_points_stand_beside_published_limits(self):
        scene = self.write("scene.yaml", FINGER.replace("write: [h5, vtp, vti]", "write: [h5, vti, png]").replace(
            "[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[focus, unscattered]") +
            "field: [{name: ear, at_mm: [-80, 0, 400]}, {name: arm, at_mm: [0, 100, 80]}]\n")
        said = self.run_ok("run", scene, "-o", "out").stdout
        found = json.loads(self.run_ok("info", "out", "--json").stdout)
        self.assertEqual([(row["point"], row["method"]) for row in found["sound_levels"]],
                         [("ear", "focus"), ("ear", "unscattered"), ("arm", "focus"), ("arm", "unscattered")])
        report = (self.folder / "out/report.html").read_text()
        table = said[said.index("sound levels, "):]
        for part in [table, self.run_ok("info", "out").stdout, report]:
            for row in found["sound_levels"]:
                self.assertRegex(part, rf"{row['point']} +{row['method']} .*{row['level_db']:.4g}")
            self.assertRegex(part, "INIRC-IRPA 1984 +public +100")
        self.assertIn("no assessment of safety", table)
        self.assertEqual([*(self.folder / "out").glob("*.vti")], [])  # of a point there is nothing to see

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

    def test_resolved_scene_runs_to_the_same_result(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "a", "--set", "solve.iterations=5", "--set", "target.pressure_pa=best")
        self.write("resolved.yaml", self.run_ok("check", scene, "--resolved", "--set", "solve.iterations=5", "--set",
                                                "target.pressure_pa=best").stdout)
        self.run_ok("run", "resolved.yaml", "-o", "b")
        with open_run(self.folder / "a") as a, open_run(self.folder / "b") as b:
            self.assertEqual(a["scene"][()], b["scene"][()])
            self.assertEqual(a["provenance"].attrs["scene_hash"], b["provenance"].attrs["scene_hash"])
            numpy.testing.assert_array_equal(a["methods/paper/phase"][:], b["methods/paper/phase"][:])
            self.assertEqual(len(a["methods/paper/cost"]), 6)

    def test_random_start_is_seeded(self):
        scene = self.write("scene.yaml", FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", """
    - {paper: {as: a, start: {random: 7}}}
    - {paper: {as: b, start: {random: 7}}}
    - {paper: {as: c, start: {random: 8}}}"""))
        self.run_ok("run", scene, "-o", "out")
        with open_run(self.folder / "out") as run:
            a, b, c = (run[f"methods/{name}/phase"][:] for name in "abc")
            self.assertIn("a=7", run["provenance"].attrs["seeds"])
        numpy.testing.assert_array_equal(a, b)
        self.assertGreater(numpy.abs(a - c).max(), 0.1)

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

    # Pictures

    def test_pictures_need_no_display(self):
        scene = self.write("scene.yaml", FINGER.replace("write: [h5, vtp, vti]", "write: [h5, png]") +
                           "field: [{name: side, plane: xz, through_mm: [0, 0, 60], size_mm: [30, 40], spacing_mm: 2}]\n")
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "XAUTHORITY")}
        done = subprocess.run([PROGRAM, "run", scene, "-o", "out", "--quiet"], cwd=self.folder, env=environment, capture_output=True,
                              text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        there = sorted(path.name for path in (self.folder / "out").glob("*.png"))
        self.assertEqual(there, ["field_side.png", "overview.png"])
        self.assertLessEqual(set(there), set(json.loads((self.folder / "out/files.json").read_text())["files"]))
        self.run_ok("run", scene, "-o", "out", "--force", "--set", "write=[h5]")
        self.assertEqual(list((self.folder / "out").glob("*.png")), [])


if __name__ == "__main__":
    unittest.main()
