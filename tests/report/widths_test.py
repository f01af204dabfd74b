"""The observers of the width discrimination in cases with known answers."""

import dataclasses
import math
import unittest

import report_support  # noqa: F401

import numpy
import scipy.stats

import widths
import widths_trials

CELLS = 12
widths.RESAMPLES = 500  # which take most of the time


def trials(hands=6, draws=10, apart=3.0, spread=0.05, seed=1, methods=widths.METHODS):
    """Patterns of three classes that differ by `apart` in three cells, with white noise of `spread`."""
    generator = numpy.random.default_rng(seed)
    rows = []
    for hand in range(hands):
        for method in methods:
            for k, width in enumerate(widths_trials.WIDTHS):
                for _ in range(draws):
                    pattern = numpy.ones(CELLS) + spread * generator.standard_normal(CELLS)
                    pattern[k] += apart
                    rows.append((f"hand_{hand:02d}", width, method, width + apart * generator.normal(0, 0.05),
                                 generator.uniform(0.25, 1), pattern))
    hand, width, method, reading, noise, pattern = map(numpy.array, zip(*rows))
    return widths_trials.Trials(hand, width, method, reading, reading.copy(), noise, pattern)


class Observers(unittest.TestCase):
    def test_distant_classes_are_always_distinguished(self):
        result = widths.analyse(trials())
        for method in widths.METHODS:
            self.assertEqual(result.score(widths.READER, method).share, 1.0)
            for observer in (widths.IDEAL, widths.EVEN):
                self.assertEqual(result.curves[observer][method][0], 1.0)

    def test_equal_classes_are_guessed(self):
        data = trials(hands=10, apart=0.0, spread=0.3)
        data.reading[:] = numpy.random.default_rng(5).normal(8, 1, len(data.reading))
        result = widths.analyse(data)
        bound = 4 * math.sqrt(2 / 9 / 300)  # four standard errors of 300 guesses
        for observer in (widths.IDEAL, widths.EVEN):
            for shares in result.curves[observer].values():
                self.assertTrue(all(abs(share - 1 / 3) < bound for share in shares), shares)
        self.assertLess(abs(result.score(widths.READER, "paper").share - 1 / 3), bound)

    def test_two_classes_in_white_noise_follow_the_normal_distribution(self):
        apart, sigma = 1.5, 0.9
        means = numpy.zeros((3, CELLS))
        means[1, 0] = apart
        means[2, 1] = 1e3  # never mistaken
        draws = numpy.random.default_rng(2).standard_normal((2, 40000, CELLS))
        answers = widths.gaussian_answers(means, numpy.zeros((CELLS, CELLS)), means[:2], draws, numpy.array([sigma]))[0]
        share = scipy.stats.norm.cdf(apart / (2 * sigma))
        for k in range(2):
            self.assertAlmostEqual(answers[k, k], share, delta=4 * math.sqrt(share * (1 - share) / 40000))

    def test_a_width_that_cannot_be_read_is_guessed(self):
        data = trials()
        data.reading[data.method == "paper"] = numpy.nan
        self.assertAlmostEqual(widths.analyse(data).score(widths.READER, "paper").share, 1 / 3)

    def test_a_width_reader_with_noise_follows_the_normal_distribution(self):
        data = trials(hands=4)
        data.reading_radiation[:] = data.width_mm  # 5, 8, 11: an answer changes 1.5 mm off
        answers = widths.width_reader(data, "paper", numpy.array([0.0, 2.0]), data.reading_radiation)
        label = widths_trials.classes(data)[data.method == "paper"]
        numpy.testing.assert_array_equal(answers[0].argmax(axis=1), label)
        right = scipy.stats.norm.cdf(1.5 / 2)
        for k, share in enumerate((right, 2 * right - 1, right)):
            numpy.testing.assert_allclose(answers[1][label == k, k], share, rtol=1e-12)
        numpy.testing.assert_allclose(answers.sum(axis=2), 1)

    def test_a_reader_of_p_sees_p(self):
        # With `unscattered` all patterns have one width in P and the right ones in abs(p)^2.
        data = trials(hands=8)
        data.reading_radiation[data.method == "unscattered"] = 6.0
        result = widths.analyse(data)
        self.assertEqual(result.score(widths.READER, "unscattered").share, 1.0)
        self.assertAlmostEqual(result.score(widths.READER_P, "unscattered").share, 1 / 3)
        self.assertTrue(result.calibrated[widths.NOISY_P])
        self.assertAlmostEqual(result.score(widths.NOISY_P, "paper").share, widths.PEOPLE["paper"], delta=0.005)
        self.assertAlmostEqual(result.score(widths.NOISY_P, "unscattered").share, 1 / 3, delta=0.005)

    def test_an_observer_does_not_learn_from_the_tested_hand(self):
        data = trials(hands=5)
        mixed = dataclasses.replace(data, width_mm=data.width_mm.copy())
        own = data.hand == "hand_02"
        mixed.width_mm[own] = numpy.roll(widths_trials.WIDTHS, 1)[widths_trials.classes(data)[own]]
        before, after = (widths.ideal_observer(each, "paper", numpy.array([0.0]), 1)[0] for each in (data, mixed))
        rows = data.hand[data.method == "paper"]
        numpy.testing.assert_array_equal(before[rows == "hand_02"], after[rows == "hand_02"])  # the answers, not whether they are right
        label = widths_trials.classes(mixed)[mixed.method == "paper"]
        right = after[numpy.arange(len(label)), label]
        self.assertEqual(right[rows == "hand_02"].max(), 0.0)

    def test_an_even_level_removes_the_information_of_loudness(self):
        data = trials(apart=0.0, spread=0.05)
        data.pattern *= 1 + widths_trials.classes(data)[:, None]  # only loudness differs
        self.assertEqual(widths.analyse(data).curves[widths.IDEAL]["paper"][0], 1.0)
        self.assertLess(widths.analyse(data).curves[widths.EVEN]["paper"][0], 0.5)

    def test_the_paired_test_agrees_with_scipy_and_reports_too_few_hands(self):
        def score(method, shares):
            return widths.Score("any", method, 0, 0, 0, len(shares), 0, shares)

        first, second = [0.61, 0.66, 0.52, 0.73, 0.58, 0.69, 0.71, 0.55], [0.5, 0.57, 0.53, 0.6, 0.4, 0.52, 0.56, 0.51]
        found = widths.compare("any", score("a", first), score("b", second))
        self.assertAlmostEqual(found.p, scipy.stats.wilcoxon(first, second, method="exact").pvalue)
        self.assertIn("too few hands", widths.compare("any", score("a", [0.6, 0.7]), score("b", [0.5, 0.4])).treatment)
        self.assertTrue(math.isnan(widths.compare("any", score("a", [0.5] * 8), score("b", [0.5] * 8)).p))
        tied = widths.compare("any", score("a", [0.6] * 6 + [0.5]), score("b", [0.5] * 7))  # all have one sign: 2 of 2^6
        self.assertAlmostEqual(tied.p, 2 / 64)
        self.assertEqual(tied.zeros, 1)

    def test_p_values_are_corrected_for_their_number(self):
        numpy.testing.assert_allclose(widths.holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
        corrected = widths.holm([0.5, math.nan, 0.02, 0.7])
        self.assertTrue(math.isnan(corrected[1]))  # no test, which the correction does not count
        numpy.testing.assert_allclose([corrected[0], corrected[2], corrected[3]], [1, 0.06, 1])


if __name__ == "__main__":
    unittest.main()
