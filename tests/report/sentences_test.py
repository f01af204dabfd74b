"""Checks that the sentences of the report follow from its tables."""

import copy
import unittest

import report_support  # noqa: F401

import numpy

import claims
import curves
import equal
import panels
import runs
import sequences
import whole_hand

NAMES = list(runs.SCENES)


def metric_rows():
    """Five scenes where scattering helps everywhere."""
    errors = {"surface": 0.45, "radiation": 0.6, "paper": 0.47, "paper_original": 0.48, "unscattered": 0.54, "unscattered_original": 0.55,
              "focus": 0.6}
    return [{"scene": name, "method": method, "relative_error": str(error), "width_mm": str(5 + error), "width_radiation_mm": str(4 + 2 * error),
             "leakage": str(error / 3), "relative_error_radiation": str(1 - error), "force_target_n": "2e-3", "abs_force_elsewhere_n": "1e-3",
             "optimality_gap": "0.0123", "optimality_gap_radiation": "0.0456", "evaluation_difference": "0.006",
             "evaluation_difference_target": "0.003"} for name in NAMES for method, error in errors.items()]


def convergence_rows(values):
    return [{"start": start, "method": method, "iterations": str(count), "relative_error": str(value)}
            for start in ("cold", "warm") for method in curves.METHODS for count, value in zip((1, 5, 10, 30), values)]


class Sentences(unittest.TestCase):
    def test_an_error_stays_near_the_last_one(self):
        self.assertEqual(curves.from_there_on([1, 5, 10, 30], [0.6, 0.461, 0.462, 0.461], 0.461), 5)
        self.assertEqual(curves.from_there_on([1, 5, 10, 30], [0.6, 0.461, 0.5, 0.461], 0.461), 30)  # near at 5, but not at 10
        self.assertEqual(curves.from_there_on([1, 5, 10, 30], [0.6, 0.461, 0.43, 0.461], 0.461), 30)  # a lower value is not near either
        self.assertIsNone(curves.from_there_on([1, 5], [0.461, 0.5], 0.461))
        said = curves.convergence_sentences(convergence_rows([0.6, 0.461, 0.462, 0.461]))
        self.assertIn("has an evaluated error of 46.1 % after 30 iterations from zero.", said[0])
        self.assertIn("From zero, the error is within half a percentage point of this value from iteration 5 onwards.", said[0])
        self.assertIn("From the previous frame, it is within half a percentage point of it from iteration 5 onwards.", said[0])
        self.assertIn("The tried numbers of iterations are 1, 5, 10, 30.", said[0])
        rows = convergence_rows([0.6, 0.461, 0.5, 0.461])
        self.assertIn("From zero, the error is within half a percentage point of this value from iteration 30 onwards.",
                      curves.convergence_sentences(rows)[0])
        for row in rows:
            if row["start"] == "warm":
                row["relative_error"] = "0.5"
        self.assertIn("From the previous frame, it does not stay within half a percentage point of it.",
                      curves.convergence_sentences(rows)[0])

    def test_scenes_with_lower_errors_are_counted(self):
        rows = metric_rows()
        said = " ".join(panels.sentences(rows, NAMES))
        self.assertIn("is lower than without (`unscattered`) on 5 of 5 scenes", said)
        self.assertNotIn("does not lower", said)
        self.assertIn("The leakage of `paper` is lower than that of `unscattered` on 5 of 5 scenes.", said)
        self.assertIn("of abs(p)^2 for 5 mm box, 8 mm box, 11 mm box are, in mm: `surface` 5.5, 5.5, 5.5; `radiation` 5.6, 5.6,", said)
        self.assertIn("of the radiation pressure P for 5 mm box, 8 mm box, 11 mm box are, in mm: `surface` 4.9, 4.9, 4.9;", said)
        self.assertIn("of the error of P: 5 mm box -15.0, ", said)
        self.assertIn("over the force on the target, is in this order 50 %, 50 %, 50 %, 50 %, 50 % with `radiation` and 50 %", said)
        self.assertIn("No choice of phases can lower the cost", said)
        self.assertIn("5 mm box 1.23 %", said)
        self.assertIn("Method `radiation` has another cost; its gap is 5 mm box 4.56 %, ", said)
        changed = copy.deepcopy(rows)
        for row in changed:
            if (row["scene"], row["method"]) == ("grasp", "paper"):
                row["relative_error"] = row["leakage"] = "0.7"
        said = " ".join(panels.sentences(changed, NAMES))
        self.assertIn("on 4 of 5 scenes", said)
        self.assertIn("Scattering in the solver does not lower the error on: grasped box.", said)
        self.assertIn("The leakage of `paper` is lower than that of `unscattered` on 4 of 5 scenes.", said)
        self.assertIn("grasped box +16.0", said)

    def test_methods_are_brought_to_one_force_and_one_peak(self):
        rows = [{"scene": name, "method": method, "force_target_n": force, "abs_force_elsewhere_n": outside, "peak_radiation_pa": peak,
                 "loudest_elsewhere": loudest, "width_radiation_mm": "5"} for name in NAMES for method, force, outside, peak, loudest in (
                     ("surface", "1e-3", "0.2e-3", "40", "0.5"), ("radiation", "2e-3", "1e-3", "60", "0.1"),
                     ("paper", "0.45e-3", "0.1e-3", "20", "0.5"), ("unscattered", "-1e-3", "1e-3", "20", "nan"),
                     ("focus", "8e-3", "8e-3", "400", "0.2"))]
        known = equal.scaled(rows)["width_8mm", "surface"]
        self.assertAlmostEqual(known["level"] ** 2 * 1e-3, equal.FORCE_N)
        self.assertEqual(equal.summary(rows)[1][0], ["width_5mm", "`surface`", "1", "71 %", "0.1", "20", "0.5", "5", "0.5"])
        said = equal.sentences(rows, NAMES)
        self.assertIn("outside at one force is in the order of the table: 0.2, 0.2, 0.2, 0.2, 0.2 with `surface`; 0.5, ", said[0])
        self.assertIn("the force at one peak of P is in the order of the table: 1.2, 1.2, 1.2, 1.2, 1.2 with `surface`; 1.7, ", said[1])
        self.assertIn("with `surface` than with `focus` on 5 of 5 scenes: 5 mm box, ", said[3])
        self.assertTrue(said[4].endswith("than with `focus` on 0 of 5 scenes."))
        self.assertIn("these reach 0.5 mN: `paper` (5 mm box), `unscattered` (5 mm box), ", said[5])

    def test_without_an_optimality_bound_nothing_is_proved(self):
        rows = metric_rows()
        for row in rows:
            if row["scene"] != "grasp":
                row["optimality_gap"] = "nan"
        said, = panels.proved(rows, NAMES)
        self.assertIn("grasped box 1.23 %", said)
        self.assertNotIn("5 mm box", said)
        for row in rows:
            row["optimality_gap"] = "nan"
        self.assertEqual(panels.proved(rows, NAMES), [])

    def test_times_are_those_of_the_tables(self):
        def rows(key, counts):
            return [{key: count, "surface_ms_an_iteration": f"{3 + i}", "paper_ms_an_iteration": f"{20 - i}",
                     "surface_once_s": f"{1 + i}", "paper_once_s": "0.5"} for i, count in enumerate(counts)]

        by_faces, by_channels = curves.times_sentences(rows("faces", [1000, 2000, 4000]), rows("channels", [100, 300]))
        self.assertIn("From 1000 to 4000 faces (4.0 times as many), the time per iteration of `surface` changes from 3 to 5 ms "
                      "(all cases: 3 to 5 ms).", by_faces)
        self.assertIn("That of `paper` changes from 20 to 18 ms (all cases: 18 to 20 ms).", by_faces)
        self.assertIn("changes from 1 to 3 s for `surface` and from 0.5 to 0.5 s for `paper`.", by_faces)
        self.assertIn("From 100 to 300 channels (3.0 times as many)", by_channels)

    # Sequences of patterns

    def row(self, frames, cost, bound="3199", surface="3200"):
        return {"frames": str(frames), "cost_pa2m2": str(cost), "misfit": f"{(cost / 14400) ** 0.5:.6f}", "bound_pa2m2": bound,
                "surface_cost_pa2m2": surface, "surface_misfit": f"{(float(surface) / 14400) ** 0.5:.6f}", "target_rows": "106",
                "outside_rows": "158", "channels": "1496"}

    def test_what_is_proved_of_sequences_follows_from_the_bound(self):
        said = " ".join(sequences.sentences([self.row(1, 3200), self.row(2, 3199.5), self.row(16, 3199.2)]))
        self.assertIn("Sequences of 2, 16 patterns reach 0.4714, 0.4713 at best.", said)
        self.assertIn("has a cost below 3199 Pa2 m2, at any length. The one pattern of `surface` is 0.03 % above this bound.", said)
        self.assertIn("The best sequence found is 0.025 % below the one pattern.", said)
        self.assertIn("106 rows for target faces, 158 rows for the skin outside the target, and 1496 columns", said)
        said = " ".join(sequences.sentences([self.row(1, 3200, "2800"), self.row(2, 3300, "2800")]))
        self.assertIn("14.29 % above this bound", said)
        self.assertIn("3.125 % above the one pattern", said)
        said = " ".join(sequences.sentences([self.row(1, 3200, "nan"), self.row(2, 3300, "nan")]))
        self.assertIn("Nothing is proved", said)
        self.assertNotIn("It is proved", said)

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

    def claims_of(self, rows, after_five=0.461, shares=(0.56, 0.56)):
        return claims.rows(rows, convergence_rows([0.6, after_five, 0.462, 0.461]),
                           [{"faces": 12000, "channels": 1496, "paper_ms_an_iteration": "25"}],
                           [{"observer": "width reader of P, own noise", "method": method, "share": share} for method, share in
                            zip(("paper", "unscattered"), shares)], [])

    def test_verdicts_follow_from_the_numbers(self):
        rows = metric_rows()
        self.assertEqual([row[2] for row in self.claims_of(rows)],
                         ["holds", "holds", "not consistent", "holds", "not compared: different machine"])
        for row in rows:
            if row["scene"] == "grasp" and row["method"].startswith("paper"):
                row["relative_error"] = "0.7"
        found = self.claims_of(rows, 0.5, (0.57, 0.46))
        self.assertEqual([row[2] for row in found[:4]], ["holds in part", "holds in part", "consistent", "fails"])
        self.assertIn("lower on 4 of 5 scenes (reduction of -16.0 to 7.0 points)", found[0][1])
        for row in rows:
            if row["method"].startswith("paper"):
                row["relative_error"] = "0.7"
        self.assertEqual(self.claims_of(rows)[0][2], "fails")

    def test_a_finger_and_its_hand_are_put_in_order(self):
        rows = [{"scene": name, "method": method, "finger_alone": f"{error}", "its_phases_on_the_hand": f"{1.2 - error}",
                 "phases_of_the_hand": f"{error + 0.1}"} for name in whole_hand.FINGERS
                for method, error in (("surface", 0.4), ("paper", 0.42), ("unscattered", 0.5))]
        said = whole_hand.finger_sentences(rows)
        self.assertIn("alone, the order of the errors is `surface` < `paper` < `unscattered`. With the same phases on the hand, it is "
                      "`unscattered` < `paper` < `surface`.", said[0])
        self.assertIn("70 % to 80 %", said[-1])
        for row in rows:
            row["its_phases_on_the_hand"] = row["finger_alone"]
        self.assertIn("on the hand, it is the same.", whole_hand.finger_sentences(rows)[0])

    # Where a table comes from

    def test_many_inputs_have_one_hash(self):
        few = runs.Made("scripts/some", ["0123abcd"], {"a.yaml": "1" * 12, "b.yaml": "2" * 12})
        self.assertEqual(few.head(), "# made by: scripts/some; revision: 0123abcd; scenes: a.yaml 111111111111, b.yaml 222222222222\n")
        many = runs.Made("scripts/some", ["0123abcd", "4567cdef"], {f"{i}.yaml": f"{i:012d}" for i in range(9)})
        self.assertIn("revision: 0123abcd and 4567cdef; scenes: 9 files, together ", many.head())
        many.inputs["3.yaml"] = "x" * 12
        self.assertNotEqual(many.scenes(), runs.Made("", [], {f"{i}.yaml": f"{i:012d}" for i in range(9)}).scenes())

    def test_settings_of_a_scene_are_read_by_their_path(self):
        scene = "name: a\narray:\n  grid:\n    count: [4, 3]\n  at_mm: [0, 0, 1]\nbody:\n  place:\n    at_mm: [0, 0, 200]\n"
        self.assertEqual(runs.setting(scene, "array.grid.count"), "[4, 3]")
        self.assertEqual(runs.setting(scene, "body.place.at_mm"), "[0, 0, 200]")
        self.assertIsNone(runs.setting(scene, "array.place.at_mm"))


if __name__ == "__main__":
    unittest.main()
