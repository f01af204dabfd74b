"""A motion from the command line: its files, a kill on the way, sweeps over motions, what is refused."""

import json
import signal
import subprocess
import time
import unittest

import h5py
import numpy

from support import FINGER, PROGRAM, CommandTest, rows_of

MOVING = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[surface, unscattered]").replace(
    "[h5, vtp, vti]", "[h5, vtp, png]") + """\
motion:
  seconds: 0.5
  change: [{path: "body.place.at_mm[0]", rate: 40}]
  solve_ms: 20
"""


class Play(CommandTest):
    def test_files(self):
        scene = self.write("scene.yaml", MOVING)
        done = self.run_ok("play", scene, "-o", "out")
        self.assertIn("surface", done.stdout)
        out = self.folder / "out"
        told = json.loads(self.run_ok("check", scene, "--json").stdout)["motion"]
        self.assertEqual((told["frames"], told["scores"]), (10, 31))
        self.assertGreater(told["seconds"], 0)
        with h5py.File(out / "motion.h5") as motion:
            self.assertEqual(motion.attrs["format"], "touchfield-motion")
            self.assertEqual(motion.attrs["complete"], 1)
            self.assertEqual(sorted(motion["methods"]), ["surface", "unscattered"])
            surface = motion["methods/surface"]
            self.assertEqual(surface["frames/phases"].shape, (10, 64))
            numpy.testing.assert_allclose(surface["frames/shown"][:], surface["frames/started"][:] + 0.021, atol=1e-9)
            time_of = surface["scores/time"][:]
            self.assertEqual(len(time_of), 31)
            moved = surface["scores/displacement"][:]
            shown = surface["scores/frame"][:] >= 0
            numpy.testing.assert_allclose(moved[shown, 0], 0.04 * surface["scores/age"][:][shown], atol=1e-9)
            numpy.testing.assert_array_equal(motion["instants/time"][:], time_of)
            self.assertEqual(motion["instants/pressure/surface"].dtype, numpy.complex64)
        self.assertEqual(len(rows_of(out / "motion.csv")), 2 * 31)
        self.assertEqual(len(rows_of(out / "frames.csv")), 2 * 10)
        series = (out / "evaluation.pvd").read_text()
        for number in range(1, 9):
            self.assertIn(f"evaluation_{number:04d}.vtp", series)
            self.assertTrue((out / f"evaluation_{number:04d}.vtp").exists())
        for picture in ("motion.png", "strip.png"):
            self.assertGreater((out / picture).stat().st_size, 5000)
        surface = json.loads(self.run_ok("info", "out/motion.h5", "--json").stdout)["methods"][0]
        self.assertEqual(surface["frames"], 10)
        self.assertTrue(0.1 < surface["relative_error_median"] <= surface["relative_error_worst"])
        self.assertIn("<h2>Results</h2>", (out / "report.html").read_text())

    def test_a_kill_leaves_the_last_whole_second(self):
        scene = self.write("scene.yaml", MOVING.replace("seconds: 0.5", "seconds: 600"))
        child = subprocess.Popen([PROGRAM, "play", scene, "-o", "out", "--quiet", "--set", "write=[h5]", "--set",
                                  "body.place.at_mm=[0, 0, 60]", "--set", "motion.change[0].rate=0.01"], cwd=self.folder)
        file = self.folder / "out.partial" / "motion.h5"
        deadline = time.monotonic() + 120
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.3)
        child.send_signal(signal.SIGKILL)
        child.wait()
        with h5py.File(file) as motion:
            self.assertEqual(motion.attrs["complete"], 0)
            frames = len(motion["methods/surface/frames/started"])
            self.assertGreaterEqual(frames, 20)
            self.assertEqual(frames % 20, 0)
        child = subprocess.Popen([PROGRAM, "play", scene, "-o", "again", "--quiet", "--set", "write=[h5]", "--set",
                                  "motion.change[0].rate=0.01"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        file = self.folder / "again.partial" / "motion.h5"
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=60)[1]
        self.assertEqual(child.returncode, 128 + signal.SIGINT)
        self.assertIn("last full second", said)
        self.assertTrue((self.folder / "again.partial" / "failed.json").exists())

    def test_sweep_over_motions(self):
        self.write("scene.yaml", MOVING)
        sweep = self.write("sweep.yaml", "base: scene.yaml\nset: {write: [h5], solve.methods: [surface]}\n"
                                         "grid:\n  motion.array_ms: [1, 100]\n")
        self.run_ok("sweep", sweep, "-o", "out", "--quiet")
        rows = rows_of(self.folder / "out" / "sweep.csv")
        self.assertEqual(len(rows), 2)
        self.assertEqual([float(row["frames"]) for row in rows], [10, 10])
        self.assertGreater(float(rows[1]["relative_error_mean"]), float(rows[0]["relative_error_mean"]) + 0.05)
        self.assertAlmostEqual(float(rows[1]["age_s_mean"]) - float(rows[0]["age_s_mean"]), 0.099, delta=0.03)
        for row in rows:
            self.assertLessEqual(float(row["relative_error_median"]), float(row["relative_error_p95"]))
            self.assertEqual(row["relative_error"], row["relative_error_median"])
        self.assertTrue((self.folder / "out" / "cases" / "00001" / "motion.h5").exists())

    def test_refused_before_anything_is_written(self):
        scene = self.write("scene.yaml", MOVING)
        before = self.entries()
        for change, part in {
                "motion.change=[{path: 'body.place.at_mm[2]', rate: -400}]": "motion: at 0.1",
                "motion.sensor={noise: {noise_mm_rms: 3, correlation_mm: 1}}": "motion.sensor: sample 0 at 0.000 s",
                "motion.sensor={cameras: [{at_mm: [300, 0, 0], look_at_mm: [0, 0, 60]}]}": "a hand is fitted",
                "motion.sensor={recorded: {folder: none}}": "none: no such folder",
                "motion=null": "no motion"}.items():
            self.is_refused("play", scene, "-o", "out", "--set", change, says=part)
            self.assertEqual(self.entries(), before)


if __name__ == "__main__":
    unittest.main()
