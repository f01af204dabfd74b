"""The study of prediction: the path of its hand, the scores that count, and its tables."""

import pathlib
import sys
import tempfile
import unittest

import report_support

import numpy

sys.path.insert(0, str(report_support.SOURCE / "scripts/makers"))
import prediction as study  # noqa: E402


class Course(unittest.TestCase):
    def setUp(self):
        self.course = study.Course(study.SPEEDS)

    def place(self, axis, time):
        return numpy.interp(time, *zip(*self.course.keys[axis]))

    def test_every_part_has_its_speed(self):
        found = set()
        for kind, axis, speed, begin, end in self.course.parts:
            found.add((kind, axis, speed))
            times = numpy.linspace(begin, end, 400)
            velocity = numpy.gradient(self.place(study.course.AXES[axis][0] if axis else 0, times), times)
            if kind == "sine":
                self.assertAlmostEqual(abs(velocity).max() / speed, 1, delta=0.01)
                self.assertAlmostEqual(end - begin, 2)
            else:
                self.assertLess(numpy.ptp(velocity), 1e-6 + 1e-6 * speed)
                self.assertAlmostEqual(abs(velocity[0]), speed, delta=1e-6 * (1 + speed))
            self.assertLessEqual(end, self.course.now + 1e-9)
        self.assertEqual(len(found), 1 + 2 * 2 * len(study.SPEEDS))


class Tables(unittest.TestCase):
    def test_gains_compare_with_the_better_alternative(self):
        """The errors of the two seeds differ by 0.1. Scores with a sample before the part do not count."""
        parts = [("rest", "", 0, 0.5, 1.0)]
        cases = study.cases_of(2)
        self.assertEqual(len(cases), 6)
        found = {}
        with tempfile.TemporaryDirectory() as folder:
            for seed, kind in cases:
                own = pathlib.Path(folder) / f"{kind}_{seed}"
                own.mkdir()
                error = {"none": 0.5, "linear": 0.6, "kalman": 0.45}[kind] + 0.1 * seed
                (own / "motion.csv").write_text("# made\ntime_s,age_s,frame,relative_error\n"
                                                f"0.6,0.2,0,9\n0.7,0.1,1,{error}\n0.8,0.1,1,{error}\n0.9,0.1,-1,9\n1.1,0.1,2,9\n")
                found[own.name] = own
            gain, = study.gains_of(cases, found, parts)
        self.assertEqual([gain[kind] for kind in study.KINDS], ["0.65", "0.75", "0.6"])
        self.assertEqual((gain["best_other"], gain["gain"], gain["seeds"]), ("none", "0.05", 2))
        self.assertAlmostEqual(float(gain["gain_standard_error"]), 0)


if __name__ == "__main__":
    unittest.main()
