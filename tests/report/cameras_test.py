"""The study of camera errors: its cases and the frames that count."""

import csv
import pathlib
import tempfile
import unittest

import report_support  # noqa: F401

import cameras
import sights


class Cases(unittest.TestCase):
    def test_every_motion_of_every_hand_has_an_exact_sensor(self):
        exact = [case.same() for case in sights.cases() if case.group == "exact"]
        self.assertEqual(len(exact), len(set(exact)))
        self.assertEqual(set(exact), {case.same() for case in sights.cases()})


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


if __name__ == "__main__":
    unittest.main()
