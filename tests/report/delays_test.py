"""The study of delays: which scores belong to which motion, and the results from small tables."""

import dataclasses
import pathlib
import tempfile
import unittest

import report_support  # noqa: F401

import numpy

import course
import delays

LOOP = {"sensor_hz": 30.0, "latency_ms": 0.0, "frames_hz": 20.0, "solve_ms": 0.0, "array_ms": 0.0}


def play(predict="none", array_ms=0.0, methods=("surface", "unscattered"), age=0.05, rise=0.1):
    """Scores every 10 ms for 1 s, all of one age. The hand moves at 50 mm/s and the error grows by `rise` per mm."""
    time = numpy.tile(numpy.arange(100) * 0.01, len(methods))
    names = numpy.repeat(methods, 100)
    ages = numpy.full(len(time), age)
    return delays.Play(pathlib.Path(), LOOP | {"array_ms": array_ms}, predict, names, time, ages, 50e3 * ages / 1e3,
                       0.45 + rise * 50 * ages + 0.08 * (names == "unscattered"))


def displacement_table(surface, unscattered, axis="across"):
    return [{"axis": axis, "method": method, "displacement_mm": str(displacement), "relative_error": str(error)}
            for method, errors in (("surface", surface), ("unscattered", unscattered))
            for displacement, error in zip((0, 1, 2, 4), errors)]


class Course(unittest.TestCase):
    def test_the_velocity_is_constant_within_a_segment(self):
        """Keys of a translation lie on a line with its speed, through the centre."""
        for segment in course.translations():
            self.assertGreater(segment.end - segment.begin, 0.4)
        text = course.translation_change()
        first = course.translations()[0]
        self.assertEqual((first.axis, first.speed, first.begin, first.end), ("across", 10, 0.15, 0.57))
        self.assertIn("[0.15, 2.1], [0.57, -2.1]", text)  # 10 mm/s for 0.42 s
        self.assertIn("[0.15, 200], [0.57, 200]", text)  # nothing else moves
        towards = course.translations()[-1]
        self.assertIn(f"[{towards.begin:g}, 242], [{towards.end:g}, 158]", text)


class Scores(unittest.TestCase):
    segment = course.Translation("across", 50, 0.2, 0.6)

    def test_scores_and_their_samples_lie_in_the_segment(self):
        seen = play(methods=("surface",))
        self.assertAlmostEqual(seen.time[delays.within(seen, self.segment)].min(), 0.25)
        self.assertAlmostEqual(seen.time[delays.within(seen, self.segment)].max(), 0.6)
        predicted = play(predict="linear", methods=("surface",))  # also the previous sample, 33 ms earlier
        self.assertAlmostEqual(predicted.time[delays.within(predicted, self.segment)].min(), 0.29)

    def test_without_prediction_the_same_ages_are_compared(self):
        young, old = play(age=0.05), play(age=0.15)
        held = delays.Play(pathlib.Path(), LOOP, "none", *(numpy.concatenate([getattr(one, name) for one in (young, old)])
                                                           for name in ("method", "time", "age", "displacement", "error")))
        rows = delays.delay_rows(held, [play("linear", 100.0, ("surface",), 0.15, rise=0.0)], [self.segment])
        self.assertEqual([(row["predict"], row["method"], row["array_ms"]) for row in rows],
                         [("none", "surface", "100"), ("none", "unscattered", "100"), ("linear", "surface", "100")])
        self.assertEqual({row["age_ms_mean"] for row in rows}, {"150"})
        self.assertEqual([float(row["error_mean"]) for row in rows], [1.2, 1.28, 0.45])

    def test_each_displacement_comes_from_the_slowest_motion_that_reaches_it(self):
        ages = numpy.linspace(0, 0.2, 21)
        slow, fast = course.Translation("along", 10, 0, 1), course.Translation("along", 50, 1, 2)
        time = numpy.concatenate([0.5 + ages, 1.5 + ages])
        moved = numpy.concatenate([10 * ages, 50 * ages])
        held = delays.Play(pathlib.Path(), LOOP, "none", numpy.array(["surface"] * 42), time, numpy.tile(ages, 2), moved,
                           0.45 + 0.05 * moved)
        rows = delays.displacement_rows(held, [fast, slow])
        self.assertEqual(rows[-1]["displacement_mm"], "10")  # the largest displacement
        for row in rows:
            displacement = float(row["displacement_mm"])
            self.assertEqual(row["from_speed_mm_s"], "10" if displacement <= 2 else "50")
            self.assertAlmostEqual(float(row["relative_error"]), 0.45 + 0.05 * displacement, places=5)


class Answers(unittest.TestCase):
    def test_crossings(self):
        row, = delays.answer_rows(displacement_table((0.45, 0.5, 0.6, 0.8), (0.54, 0.56, 0.605, 0.79)))
        self.assertEqual(float(row["equal_mm"]), 1.4)
        self.assertEqual([float(row[f"equal_ms_at_{speed}"]) for speed in (10, 50, 200)], [140, 28, 7])
        self.assertAlmostEqual(float(row["alike_mm"]), 1 + 0.05 / 0.055, places=3)  # the gain falls from 6 to 0.5 points
        self.assertEqual([float(row[f"beyond_{which}_points"]) for which in ("least", "most")], [-1, 0.5])

    def test_parts_of_the_loop(self):
        """Samples that wait 10 ms, 45 ms to solve, held for 0 to 50 ms."""
        milliseconds = numpy.arange(1000)
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "frames.csv").write_text("method,frame,sampled_s,started_s\nfocus,0,0.04,0.05\nfocus,1,0.09,0.1\n")
            whole = play(methods=("surface",))
            whole = dataclasses.replace(whole, folder=pathlib.Path(folder), loop=LOOP | {"solve_ms": 45.0},
                                        time=milliseconds / 1e3, age=0.055 + milliseconds % 50 / 1e3)
            late = dataclasses.replace(whole, loop=whole.loop | {"latency_ms": 5.0})
            rows = delays.loop_rows([whole, late])
        self.assertAlmostEqual(float(rows[0]["wait_ms_mean"]), 10)
        self.assertAlmostEqual(float(rows[0]["hold_ms_mean"]), 24.5)
        self.assertAlmostEqual(float(rows[0]["age_ms_worst"]), 104)


if __name__ == "__main__":
    unittest.main()
