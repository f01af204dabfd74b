"""Patterns from the command line: their files, what send makes of them, what is refused."""

import json
import unittest

import h5py
import numpy

from support import FINGER, CommandTest, rows_of

CIRCLE = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[surface]").replace(
    "[h5, vtp, vti]", "[h5, png]").replace("edge_mm: 2.6", "edge_mm: 1.8") + """\
pattern:
  circle: {at: bottom, radius_mm: 3, hz: 100}
  amplitude: {hz: 50, depth: 0.5}
  frames_per_second: 1000
  most_turn_deg: 60
  watch: [bottom]
  ring_up_ms: 0.3
"""


class Pattern(CommandTest):
    def test_files_and_what_a_board_gets(self):
        scene = self.write("scene.yaml", CIRCLE)
        done = self.run_ok("pattern", scene, "-o", "out", "--check", "10")
        self.assertIn("rms 5-15hz [Pa]", done.stdout)
        self.assertLessEqual(max(map(len, done.stdout.splitlines())), 100)
        out = self.folder / "out"
        with h5py.File(out / "pattern.h5") as file:
            self.assertEqual(file.attrs["format"], "touchfield-motion")
            self.assertEqual(file.attrs["complete"], 1)
            surface = file["methods/surface"]
            phases = surface["frames/phases"][:]
            amplitudes = surface["frames/amplitudes"][:]
            numpy.testing.assert_allclose(surface["frames/shown"][:], numpy.arange(20) / 1000, atol=1e-12)
            errors = surface["scores/relative_error"][:]
            self.assertEqual(file["instants/pressure/surface"].shape[0], 20)
            self.assertEqual(file["instants/vertices"].shape[0], 1)  # the skin stands still
            self.assertEqual(sorted(surface["watched"]), ["bottom", "opposite", "start"])
        self.assertEqual(phases.shape, (20, 64))
        turns = phases - numpy.roll(phases, 1, axis=0)
        turns = numpy.abs((turns + numpy.pi) % (2 * numpy.pi) - numpy.pi)
        self.assertLessEqual(turns.max(), numpy.radians(60) + 1e-9)
        self.assertGreater(turns.max(), numpy.radians(30))
        frames = rows_of(out / "pattern.csv")
        self.assertEqual(len(frames), 20)
        numpy.testing.assert_allclose([float(row["relative_error"]) for row in frames], errors)
        numpy.testing.assert_allclose([float(row["turn_deg"]) for row in frames], numpy.degrees(turns.max(axis=1)), atol=1e-6)
        numpy.testing.assert_allclose([float(row["level"]) for row in frames], amplitudes.max(axis=1))
        worst = 1 + numpy.argmax(errors[1:])
        self.assertEqual([row["relative_error_alone"] != "nan" for row in frames],
                         [k % 10 == 0 or k == worst for k in range(20)])
        # Bands are sums of lines, and lines those of the held radiation pressure.
        lines = [row for row in rows_of(out / "spectrum.csv") if row["point"] == "start"]
        self.assertEqual([float(row["hz"]) for row in lines], [50.0 * m for m in range(1, 11)])
        self.assertEqual({row["bin_hz"] for row in lines}, {"50"})
        series = numpy.fft.fft([float(row["radiation_pa_start"]) for row in frames]) / 20
        wanted = [2 * abs(series[m] * numpy.sinc(m / 20)) ** 2 for m in range(1, 11)]
        numpy.testing.assert_allclose([float(row["radiation_mean_square_pa2"]) for row in lines], wanted, rtol=1e-6, atol=1e-20)
        self.assertGreater((out / "strip.png").stat().st_size, 5000)
        self.assertIn("rms 5-15hz [Pa]", (out / "report.html").read_text())
        self.run_ok("info", "out")

        said = json.loads(self.run_ok("send", "out", "--json").stdout)
        self.assertEqual((said["frames"], said["rate_hz"]), (20, 1000.0))
        self.assertAlmostEqual(said["seconds"], 0.02)
        slower = json.loads(self.run_ok("send", "out/pattern.h5", "--rate", "10", "--json").stdout)
        self.assertAlmostEqual(slower["seconds"], 2)

    def test_warnings(self):
        scene = self.write("scene.yaml", CIRCLE)
        for changes, says in [(["pattern.amplitude.hz=200", "pattern.pressure_pa=1e9"],
                               ["few_frames: pattern.amplitude.hz = 200 has 5 frames per period", "below_wanted: 10 of 10 frames"]),
                              (["pattern.seconds=0.015", "pattern.most_turn_deg=20"],
                               ["part_period: pattern.seconds = 0.015 has 1.5 periods of pattern.circle.hz",
                                "so the pattern jumps at each repeat; 0.02 would fit", "raise pattern.most_turn_deg or frames_per_second"])]:
            done = self.run_ok("pattern", scene, "-o", "out", "--force", "--set", "write=[h5]", *[f"--set={change}" for change in changes])
            with h5py.File(self.folder / "out/pattern.h5") as file:
                kept = list(file["warnings"].asstr())
            for said in says:
                self.assertIn(said, done.stderr)
                self.assertTrue(any(said in text for text in kept), said)
        done = self.run_ok("pattern", scene, "-o", "out", "--force", "--json", "--set", "pattern.most_turn_deg=null",
                           env={"OPENBLAS_CORETYPE": "Haswell"})  # rounding decides which local minimum a frame ends in
        for name in ("few_frames", "part_period", "below_wanted", "frames_behind"):
            self.assertNotIn(name, done.stderr)
        said = json.loads(done.stdout)
        self.assertEqual([point["point"] for point in said["radiation_pressure"]], ["bottom", "start", "opposite"])
        self.assertLess(said["relative_error"]["worst"], 1)
        self.assertGreater(said["relative_error_ring_up"]["mean"], said["relative_error"]["mean"])

    def test_check_says_what_it_takes(self):
        scene = self.write("scene.yaml", CIRCLE)
        change = ["--set", "pattern.seconds=0.1", "--set", "pattern.amplitude.hz=200"]
        told = json.loads(self.run_ok("check", scene, *change, "--json").stdout)
        said = told["pattern"]
        self.assertEqual((said["frames"], said["pass_s"]), (100, 0.1))
        self.assertTrue(any(text.startswith("few_frames: ") for text in told["warnings"]))

    def test_refused(self):
        still = self.write("still.yaml", CIRCLE[:CIRCLE.index("pattern:")])
        self.is_refused("pattern", still, "-o", "out", says="the scene has no pattern: section")
        scene = self.write("scene.yaml", CIRCLE)
        for change, said in [("pattern.circle.at=botom", "pattern.circle.at = botom must be one of"),
                             ("pattern={}", "must have one of circle, line, points, amplitude"),
                             ("pattern.circle.hz=500", "pattern.circle.hz = 500 must be below half of frames_per_second = 1000"),
                             ("pattern.seconds=0.0123", "pattern.seconds = 0.0123 are 12.3 frames"),
                             ("pattern.circle.radius_mm=40", "pattern.circle: ("),
                             ("pattern.line={from: bottom, to: top}", "pattern: ")]:
            self.is_refused("pattern", scene, "-o", "out", "--set", change, says=said)


if __name__ == "__main__":
    unittest.main()
