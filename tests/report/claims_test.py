"""Checks the verdicts on published statements, the sequences of patterns, and where tables come from."""

import pathlib
import shutil
import tempfile
import unittest

import report_support  # noqa: F401

import numpy

import claims
import page
import runs
import sequences


class Claims(unittest.TestCase):
    def setUp(self):
        errors = {"paper": 0.47, "paper_original": 0.48, "unscattered": 0.54, "unscattered_original": 0.55}
        self.metrics = [{"scene": name, "method": method, "relative_error": error} for name in runs.SCENES
                        for method, error in errors.items()]

    def verdicts(self, after_five=0.461, shares=(0.56, 0.56), milliseconds="25"):
        tables = {"metrics": self.metrics, "forearm": [row | {"error_alone": row["relative_error"]} for row in self.metrics],
                  "convergence": [{"start": "warm", "method": "paper", "iterations": count, "relative_error": error}
                                  for count, error in ((1, 0.6), (5, after_five), (10, 0.462), (30, 0.461))],
                  "iteration_faces": [{"faces": "12000", "paper_ms_an_iteration": milliseconds, "threads": "2", "processor": "any"}],
                  "widths": [{"observer": "width reader of P, own noise", "method": method, "share": share}
                             for method, share in zip(("paper", "unscattered"), shares)]}
        return claims.rows(tables)

    def test_verdicts_follow_from_the_numbers(self):
        found = self.verdicts()
        self.assertEqual([row["verdict"] for row in found],
                         ["holds", "holds", "holds", "not consistent", "holds", "not compared: different machine", "open"])
        self.assertEqual(found[0]["result"], "lower on 5 of 5 scenes, by 7.0 to 7.0 points")
        for row in self.metrics:
            if row["scene"] == "grasp" and row["method"].startswith("paper"):
                row["relative_error"] = 0.7
        found = self.verdicts(0.5, (0.57, 0.46), "9.5")
        self.assertEqual([row["verdict"] for row in found[:6]],
                         ["holds in part", "holds in part", "holds in part", "consistent", "fails", "holds"])
        self.assertEqual(found[0]["result"], "lower on 4 of 5 scenes, by -16.0 to 7.0 points")
        for row in self.metrics:
            if row["method"].startswith("paper"):
                row["relative_error"] = 0.7
        self.assertEqual(self.verdicts()[0]["verdict"], "fails")

    def test_the_kept_page_has_the_verdicts_of_the_kept_tables(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "tables"
            shutil.copytree(page.PAGE.parent / "tables", folder)
            page.write_claims(folder, "scripts/reproduce")
            self.assertEqual((folder / "claims.csv").read_text(), (page.PAGE.parent / "tables/claims.csv").read_text())
        for row in runs.table(page.PAGE.parent / "tables/claims.csv"):
            self.assertIn(f"| {row['statement']} | {row['result']} | {row['verdict']} |", page.PAGE.read_text())


class Sequences(unittest.TestCase):
    def test_two_patterns_do_what_one_cannot(self):
        """|1 + z|, |1 - z| and |1 + i z| cannot all be sqrt 2 for one z of length 1, but can in the mean of z and -z."""
        problem = sequences.Problem(numpy.array([[1, 1], [1, -1], [1, 1j]]), numpy.zeros((0, 2), complex), numpy.ones(3),
                                    numpy.full(3, numpy.sqrt(2)), surface=1.0, bound=0.0)
        one = min(sequences.least(problem, 1, seed)[0] for seed in range(4))
        phase = numpy.linspace(0, 2 * numpy.pi, 100001)
        z = numpy.exp(1j * phase)
        best = sum((abs(a) - numpy.sqrt(2)) ** 2 for a in (1 + z, 1 - z, 1 + 1j * z)).min()
        self.assertAlmostEqual(one, best, delta=1e-7)
        self.assertGreater(one, 0.1)
        self.assertLess(min(sequences.least(problem, 2, seed)[0] for seed in range(4)), 1e-9)

    def test_slopes_are_those_of_the_cost(self):
        generator = numpy.random.default_rng(1)

        def normal(*shape):
            return generator.standard_normal(shape) + 1j * generator.standard_normal(shape)

        problem = sequences.Problem(normal(4, 9), normal(5, 9), generator.uniform(0.5, 1, 4), generator.uniform(1, 3, 4), 1.0, 0.0)
        phase, way = generator.uniform(0, 6, (9, 3)), generator.standard_normal((9, 3))
        slope = (sequences.cost_and_slope(problem, phase)[1] * way).sum()
        step = 1e-6
        ahead, behind = (sequences.cost_and_slope(problem, phase + sign * step * way)[0] for sign in (1, -1))
        self.assertAlmostEqual((ahead - behind) / (2 * step), slope, delta=1e-6 * abs(slope))


if __name__ == "__main__":
    unittest.main()
