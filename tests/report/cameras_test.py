"""The study of camera errors: its cases, and the sentences from a small table."""

import csv
import pathlib
import tempfile
import unittest

import report_support  # noqa: F401

import cameras
import runs
import sights


def row(sensor, value, above, patch="0.1", hand=sights.TEMPLATES, lost="0", error=0.45):
    return {"sensor": sensor, "value": value, "hand": hand, "frames": "20", "lost": lost, "skin_mm": patch, "patch_mm": patch,
            "error_mean": str(error + above), "error_p95": str(error + above), "above": str(above)}


ROWS = [row("exact", "", 0, "nan"), row("noise", "0.5", 0.01, "0.5"), row("cameras", "1", 0.02, "0.3"),
        row("cameras", "3", 0.004, "0.12"),
        row("disparity noise", "0.32", 0.03, "0.4"), row("disparity noise", "0", 0.001, "0.04"),
        row("hand", sights.BUMPY, 0.025, "0.2", sights.BUMPY, "2"),
        row("distance", "0.75", float("nan"), "nan", lost="20"), row("distance", "2", 0.02)]
THIRDS = [{"observer": "width reader", "method": "paper", "third": third, "noise_low_mm": low, "noise_high_mm": high, "share": share}
          for third, low, high, share in (("lowest", "0.26", "0.46", "0.92"), ("middle", "0.46", "0.6", "0.9"),
                                          ("highest", "0.6", "0.97", "0.85"))]


class Cases(unittest.TestCase):
    def test_names_are_valid_and_differ(self):
        names = [case.name() for case in sights.cases()]
        self.assertEqual(len(names), len(set(names)))
        for name in names:
            self.assertRegex(name, r"^[A-Za-z0-9_-]+$")

    def test_scale_multiplies_the_distance_from_the_hand(self):
        self.assertIn("at_mm: [-560, -50, -215]", sights.cameras(count=1, scale=2)["motion.sensor"])
        self.assertIn("at_mm: [-280, -50, 0]", sights.cameras(count=1)["motion.sensor"])

    def test_every_motion_of_every_hand_has_an_exact_sensor(self):
        exact = [case.same() for case in sights.cases() if case.group == "exact"]
        self.assertEqual(len(exact), len(set(exact)))
        self.assertEqual(set(exact), {case.same() for case in sights.cases()})

    def test_every_group_has_words(self):
        self.assertEqual({case.group for case in sights.cases()} - {"exact"}, set(cameras.GROUPS))


class Table(unittest.TestCase):
    def written(self, folder, name, rows):
        with open(folder / name, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    def test_the_first_frames_of_a_case_do_not_count(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            frames = [{"frame": k, "lost": int(k == 7), "skin_off_mm": "nan" if k == 7 else 9 if k < sights.SETTLED else 0.3,
                       "patch_off_mm": "nan" if k == 7 else 0.2} for k in range(10)]
            self.written(folder, "frames.csv", frames)
            self.written(folder, "motion.csv", [{"frame": k, "relative_error": 0.9 if k < sights.SETTLED else 0.5} for k in range(10)])
            found = cameras.row_of(sights.Case("cameras", "3", {}), folder)
        self.assertEqual((found["frames"], found["lost"]), ("6", "1"))
        self.assertEqual((found["skin_mm"], found["patch_mm"], found["error_mean"]), ("0.3", "0.2", "0.5"))

    def test_a_group_includes_the_standard_case_in_order(self):
        self.assertEqual([own["value"] for own in cameras.group_of(ROWS, "disparity noise")], ["0", "0.08", "0.32"])
        self.assertEqual([own["value"] for own in cameras.group_of(ROWS, "cameras")], ["1", "3"])


class Sentences(unittest.TestCase):
    def test_numbers_come_from_the_table(self):
        said = cameras.sentences(ROWS, THIRDS)
        self.assertIn("45.0 %", said[0])
        self.assertIn("+0.4 points", said[0])
        self.assertIn("0.12 mm rms around the target", said[0])
        self.assertTrue(any("lost in 2 of 20 frames (bumpy)." in line for line in said), said)
        self.assertTrue(any("+0.4 points (default size)" in line for line in said), said)
        self.assertTrue(any(line.endswith("by +0.4 points (1) and +2.0 points (2). The skin around the target is off by 0.12 mm and "
                                          "0.1 mm. The hand is always lost (0.75).") for line in said), said)
        self.assertTrue(any("is +3.0 points (disparity noise [pixels rms]: 0.32)" in line for line in said), said)
        self.assertIn("by 0.12 mm, which is below 0.46 mm. ", said[-1])
        self.assertTrue(said[-1].endswith("By this model camera errors cannot explain it."), said[-1])

    def test_errors_above_those_of_all_trials_may_explain_it(self):
        worse = [own | {"patch_mm": "1.5"} if (own["sensor"], own["value"]) == ("cameras", "3") else own for own in ROWS]
        said = cameras.sentences(worse, THIRDS)[-1]
        self.assertTrue(said.endswith("by 1.5 mm, which is not below 0.97 mm. By this model camera errors may explain it."), said)

    def test_there_is_no_answer_without_the_study_of_widths(self):
        self.assertFalse(any("Can camera errors explain" in line for line in cameras.sentences(ROWS, [])))


class Population(unittest.TestCase):
    def test_the_sentence_counts_all_hands(self):
        rows = [{"cameras": cameras_, "group": "kind", "name": name, "hands": hands, "found": found, "wrong": "0.01", "skin_mm": "1.5",
                 "tip_mm": "6"} for cameras_, name, hands, found in (("1", "plain", "20", "0.5"), ("1", "all", "40", "0.9"),
                                                                     ("3", "plain", "20", "0.4"), ("3", "all", "40", "0.8"))]
        said = cameras.population_sentence(rows)
        self.assertIn("40 hands of the body model anny", said)
        self.assertIn("of one camera, 90.0 % of the hands are found. With three cameras the hand is found in 80.0 % of the frames. "
                      "In 1.0 %", said)

    def test_the_stored_table_has_the_rows_for_the_report(self):
        self.assertIn("With three cameras", cameras.population_sentence(runs.table(cameras.POPULATION)))


if __name__ == "__main__":
    unittest.main()
