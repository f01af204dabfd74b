"""What the skin does under a result: touchfield felt, and the scene key."""

import json
import math
import unittest

import h5py
import numpy

from pattern_test import CIRCLE
from support import FINGER, CommandTest, rows_of

STILL = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[surface, focus]").replace("[h5, vtp, vti]", "[h5]")
SKINS = ["soft", "middle", "stiff", "none"]


def number(row, column):
    return float(row[column])


class Felt(CommandTest):
    def test_a_run_and_the_command_say_the_same(self):
        scene = self.write("scene.yaml", STILL + "felt: {modulation_hz: 100, layers: half_space}\n")
        self.run_ok("run", scene, "-o", "out")
        said = self.run_ok("felt", "out", "-o", "felt")
        self.assertIn("p at equal rms [dB]", said.stdout)
        for name in ("felt.csv", "felt_spectrum.csv"):
            self.assertEqual((self.folder / "felt" / name).read_text(), (self.folder / "out" / name).read_text())
        rows = rows_of(self.folder / "out/felt.csv")
        self.assertEqual([(row["method"], row["skin"]) for row in rows], [(m, s) for m in ("surface", "focus") for s in SKINS])
        surface = {row["skin"]: row for row in rows[:4]}
        self.assertGreater(number(surface["soft"], "displacement_rms_um"), 2 * number(surface["middle"], "displacement_rms_um"))
        self.assertGreater(number(surface["middle"], "displacement_rms_um"), 2 * number(surface["stiff"], "displacement_rms_um"))
        self.assertEqual([row["p_db"] for row in rows[:4]], ["0"] * 4)
        # P / 2 at the frequency, P / 8 at twice that, of the radiation pressure in run.h5
        lines = [row for row in rows_of(self.folder / "out/felt_spectrum.csv")
                 if row["method"] == "focus" and row["skin"] == "none" and row["point"] == "middle"]
        self.assertEqual([number(row, "hz") for row in lines], [100, 200])
        with h5py.File(self.folder / "out/run.h5") as run, h5py.File(self.folder / "felt/felt.h5") as felt:
            radiation = run["methods/focus/radiation"][:][felt["patch/faces"][:]]
            at = numpy.linalg.norm(felt["patch/places"][:], axis=1)
            self.assertAlmostEqual(number(lines[0], "pressure_peak_pa") / (0.5 * radiation[at.argmin()]), 1, delta=0.1)
            self.assertAlmostEqual(number(lines[0], "pressure_peak_pa") / number(lines[1], "pressure_peak_pa"), 4)
            numpy.testing.assert_allclose(felt["methods/focus/radiation_rms"][:], abs(radiation) * (0.125 + 1 / 128) ** 0.5)
            moved = felt["methods/focus/skins/middle/displacement"][:]
            self.assertEqual(moved.shape, (49, 49))
            self.assertAlmostEqual(1e6 * numpy.nanmax(moved), number(rows[5], "displacement_rms_um"), 5)
            self.assertNotIn("energy_pc", felt["methods/focus/skins/none"])

    def test_a_pattern(self):
        self.run_ok("pattern", self.write("scene.yaml", CIRCLE), "-o", "out")
        self.run_ok("run", self.write("still.yaml", STILL), "-o", "still")
        said = json.loads(self.run_ok("felt", "out", "-o", "felt", "--against", "still", "--json",
                                      "--set", "felt.highest_hz=400").stdout)
        louder = said["skins"][3]["p_db"] - said["skins"][3]["p_at_equal_rms_db"]
        still = json.loads(self.run_ok("felt", "still", "-o", "other", "--json").stdout)["skins"][3]
        self.assertAlmostEqual(louder, 20 * math.log10(said["skins"][3]["pressure_rms_pa"] / still["pressure_rms_pa"]))
        self.assertEqual([row["skin"] for row in said["skins"]], SKINS)
        lines = rows_of(self.folder / "felt/felt_spectrum.csv")
        self.assertEqual(sorted({number(row, "hz") for row in lines}), [50.0 * m for m in range(1, 9)])
        self.assertEqual({row["point"] for row in lines}, {"middle", "bottom", "start", "opposite"})
        with h5py.File(self.folder / "felt/felt.h5") as felt:
            places = dict(zip(felt["points/name"].asstr()[:], felt["points/place"][:]))
        self.assertLess(numpy.linalg.norm(places["start"] + places["opposite"]), 2e-3)  # the middle is that of the circle
        # The lines of P at a point are those of pattern.csv, but for the flow along the skin and the faces about it.
        series = numpy.fft.fft([float(row["radiation_pa_start"]) for row in rows_of(self.folder / "out/pattern.csv")]) / 20
        strongest = 2 * abs(series[2] * numpy.sinc(2 / 20))
        found = [number(row, "pressure_peak_pa") for row in lines if row["skin"] == "none" and row["point"] == "start"]
        self.assertAlmostEqual(found[1] / strongest, 1, delta=0.2)
        with h5py.File(self.folder / "felt/felt.h5") as file:
            self.assertIn("highest_hz: 400", file["scene"][()].decode())
            skin = file["methods/surface/skins/soft"]  # squares of lines, weighted by thresholds: 12 dB per octave to 250 Hz
            hz = file["methods/surface/hz"][:]
            octaves = numpy.log2(250 / hz[hz >= 40])
            gain = 10 ** (-numpy.where(octaves > 0, 12, -9) * octaves / 20)
            squares = 0.5 * abs(skin["spectrum"][0][hz >= 40] * gain) ** 2  # in the middle
            self.assertAlmostEqual(skin["weighted_p"][24, 24] / squares.sum() ** 0.5, 1, 5)

    def test_what_cannot_be_computed(self):
        scene = self.write("scene.yaml", STILL.replace("surface, ", "") + "felt: {}\n")
        done = self.run_ok("run", scene, "-o", "good", "--set", "felt.reference=paper")
        self.assertIn("felt_failed: felt.reference = paper", done.stderr)  # the results stand
        self.run_ok("info", "good")
        for change, says in (("solve.iterations=2", "only keys of felt can be set"), ("felt.at_mm=[0, 0, 0]", "mm off the skin"),
                             ("felt.points_mm=[[0, 0, 0]]", "is not on the skin that is computed")):
            self.is_refused("felt", "good", "--set", change, says=says)


if __name__ == "__main__":
    unittest.main()
