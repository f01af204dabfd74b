"""Tests whether boxes of 5, 8 and 11 mm can be distinguished by the pressure on the skin.

The input is a folder of hands, each the output of `touchfield sweep scenes/sweeps/widths.yaml`. Each observer learns on all other
hands. It is tested on the hand left out: which of the three widths was meant? Some observers read a width, of abs(p)^2 or of the
radiation pressure P, without or with noise of their own. The ideal one sees the whole pattern, unchanged or scaled to one level.
Observers are models. They show what reaches the skin, not what people feel.
"""

import dataclasses
import math

import numpy as np
import scipy.stats

from widths_trials import WIDTHS, Trials, classes, evened

CHANCE = 1 / len(WIDTHS)
PEOPLE = {"paper": 0.56, "unscattered": 0.47}  # Matsubayashi, Makino, Shinoda, EuroHaptics 2020
PEOPLE_DIFFERENCE = (0.01, 0.17)  # 95 % interval of `paper` - `unscattered` that ten people leave
METHODS = ["surface", "radiation", "paper", "unscattered"]
PAIRS = [("paper", "unscattered"), ("surface", "paper"), ("radiation", "paper")]
READER, READER_P = "width reader", "width reader of P"
NOISY, NOISY_P = "width reader, own noise", "width reader of P, own noise"
IDEAL, EVEN = "ideal observer", "ideal observer, even level"
OBSERVERS = [READER, READER_P, NOISY, NOISY_P, IDEAL, EVEN]
NOISELESS = [READER, READER_P]  # but for the camera's noise, which all have
READ = {READER: "reading", READER_P: "reading_radiation", NOISY: "reading", NOISY_P: "reading_radiation"}
DRAWS = 20  # of the internal noise per trial
SIGMAS = np.concatenate([[0], np.geomspace(0.02, 10, 12)])
FITTED = np.geomspace(0.5, 2, 15)  # times the fitted sigma: the range in which sigma is fitted to resamples
RESAMPLES = 10000  # resamples of the hands
ENDS = [2.5, 97.5]  # of intervals, in percent


@dataclasses.dataclass
class Score:
    """Shares correct of one observer with one method. `low` to `high` is the 95 % interval over resamples."""
    observer: str
    method: str
    share: float
    low: float
    high: float
    hands: int
    trials: int
    per_hand: list[float]


@dataclasses.dataclass
class Comparison:
    """Wilcoxon's two-sided signed-rank test of the shares correct per hand. `difference` is the mean of first - second.

    `p_holm` is p corrected for all tests, `p_sigma_low` and `p_sigma_high` are p at the ends of the interval of a fitted noise.
    """
    observer: str
    first: str
    second: str
    difference: float
    statistic: float  # the smaller sum of ranks
    p: float
    hands: int
    zeros: int  # hands without a difference; the test drops them
    treatment: str
    low: float = math.nan
    high: float = math.nan
    p_holm: float = math.nan
    p_sigma_low: float = math.nan
    p_sigma_high: float = math.nan


@dataclasses.dataclass
class Result:
    """Sigma is in units of the wanted pressure squared, of width readers in mm."""
    sigma: dict[str, float]  # of each observer; 0 for those without noise of their own
    sigma_interval: dict[str, tuple[float, float]]  # 95 % over resamples; NaN where nothing was fitted
    calibrated: dict[str, bool]  # at `sigma` it is as good with `paper` as people were
    scores: list[Score]
    comparisons: list[Comparison]
    curves: dict[str, dict[str, list[float]]]  # observer with noise: method: share correct per sigma
    noise: list[dict]  # rows of widths_noise.csv

    def score(self, observer: str, method: str) -> Score:
        return next(s for s in self.scores if (s.observer, s.method) == (observer, method))


def shrunk_covariance(residuals: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance of rows of mean 0, shrunk towards a multiple of the identity, and the shrinkage (0 to 1).

    Ledoit, Wolf, J. Multivariate Analysis 88 (2004), 365-411, section 3.2.
    """
    n, cells = residuals.shape
    sample = residuals.T @ residuals / n
    target = np.trace(sample) / cells * np.eye(cells)
    distance = ((sample - target) ** 2).sum()
    error = ((residuals**2).sum(axis=1) ** 2).sum() / n**2 - (sample**2).sum() / n
    shrinkage = min(max(error, 0), distance) / distance if distance > 0 else 0.0
    return shrinkage * target + (1 - shrinkage) * sample, shrinkage


def gaussian_answers(means: np.ndarray, covariance: np.ndarray, patterns: np.ndarray, draws: np.ndarray,
                     sigmas: np.ndarray) -> np.ndarray:
    """Shares of the draws in which an observer that knows the classes answers each of them: [sigmas, trials, classes].

    It sees a pattern plus sigma times a draw (`draws` [trials, draws, cells], white, variance 1). It answers the class with the
    largest posterior. The classes are Gaussian and equally likely, with these means and this covariance + sigma^2 I.
    """
    variance, axes = np.linalg.eigh(covariance)
    answers = []
    for sigma in sigmas:
        # The floor avoids a division by 0 if sigma is 0 and all patterns of a class are the same.
        weights = means @ axes / (np.maximum(variance, 0) + sigma**2 + 1e-12) @ axes.T
        score = (patterns @ weights.T)[:, None] + sigma * (draws @ weights.T) - (weights * means).sum(axis=1) / 2
        answers.append((score.argmax(axis=2)[..., None] == np.arange(len(means))).mean(axis=1))
    return np.array(answers)


def ideal_observer(trials: Trials, method: str, sigmas: np.ndarray, seed: int) -> np.ndarray:
    """Answers to the trials of a method in their order, [sigmas, trials, 3]. All methods get the same internal noise."""
    rows = trials.method == method
    hand, label, pattern = trials.hand[rows], classes(trials)[rows], trials.pattern[rows]
    answers = np.empty((len(sigmas), len(hand), len(WIDTHS)))
    for number, name in enumerate(np.unique(trials.hand)):
        test, train = hand == name, hand != name
        means = np.array([pattern[train & (label == k)].mean(axis=0) for k in range(len(WIDTHS))])
        covariance, _ = shrunk_covariance(pattern[train] - means[label[train]])
        draws = np.random.default_rng([seed, number]).standard_normal((test.sum(), DRAWS, pattern.shape[1]))
        answers[:, test] = gaussian_answers(means, covariance, pattern[test], draws, sigmas)
    return answers


def width_reader(trials: Trials, method: str, sigmas: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Shares of the answers to the trials of a method in their order, [sigmas, trials, 3]; 1/3 each if no width was read.

    It answers the width whose mean reading is nearest to its own, which has Gaussian noise of sigma [mm].
    """
    rows = trials.method == method
    hand, label, reading = trials.hand[rows], classes(trials)[rows], reading[rows]
    answers = np.full((len(sigmas), len(hand), len(WIDTHS)), CHANCE)
    for name in np.unique(hand):
        known = (hand != name) & np.isfinite(reading)
        means = {k: reading[known & (label == k)].mean() for k in range(len(WIDTHS)) if (known & (label == k)).any()}
        test = np.flatnonzero((hand == name) & np.isfinite(reading))
        if len(means) == 0:
            continue
        order = sorted(means, key=means.get)
        ends = [-math.inf, *((means[a] + means[b]) / 2 for a, b in zip(order, order[1:])), math.inf]
        for s, sigma in enumerate(sigmas):
            off = np.array(ends) - reading[test][:, None]
            below = scipy.stats.norm.cdf(off / sigma) if sigma > 0 else (off > 0).astype(float)
            answers[s, test] = 0
            answers[np.ix_([s], test, order)] = np.diff(below, axis=1)
    return answers


def answers_of(trials: Trials, observer: str, method: str, sigmas: np.ndarray, seed: int) -> np.ndarray:
    """Of any observer: [sigmas, trials, 3]."""
    if observer in READ:
        return width_reader(trials, method, sigmas, getattr(trials, READ[observer]))
    return ideal_observer(trials, method, sigmas, seed)


def right_of(trials: Trials, observer: str, method: str, sigmas: np.ndarray, seed: int) -> np.ndarray:
    """Shares of right answers: [sigmas, trials]."""
    label = classes(trials)[trials.method == method]
    return answers_of(trials, observer, method, sigmas, seed)[:, np.arange(len(label)), label]


def calibrate(trials: Trials, observer: str, sigmas: np.ndarray, shares: np.ndarray, seed: int) -> tuple[float, bool]:
    """The sigma at which the observer is as good with `paper` as people were, and whether it exists.

    Otherwise sigma is 0 if the observer is worse than people even without noise, else the largest one.
    """
    sigmas, level = sigmas[1:], PEOPLE["paper"]
    place = refitted(shares[None, 1:], level)[0]
    if place in (0, len(sigmas) - 1):
        return (0.0 if place == 0 else float(sigmas[-1])), False
    # The grid is coarse for the slope there, so the interval is divided again.
    finer = np.geomspace(*sigmas[int(place):int(place) + 2], 9)
    share = right_of(trials, observer, "paper", finer, seed).mean(axis=1)
    return float(finer[0] * (finer[1] / finer[0]) ** refitted(share[None], level)[0]), True


def signed_ranks(first: np.ndarray, second: np.ndarray) -> tuple[float, float, str]:
    """Wilcoxon's statistic (the smaller sum of ranks), p, and the kind of test.

    Zeros are dropped. Ties get midranks. p is exact for up to 13 hands with ties (from all signs) or 50 without. For more hands it
    is a normal approximation. It is NaN if no hand differs.
    """
    difference = np.round(np.array(first) - second, 12)
    nonzero = difference[difference != 0]
    ranks = scipy.stats.rankdata(np.abs(nonzero))
    ties, p, treatment = len(set(ranks)) < len(ranks), math.nan, "no hand differs"
    if len(nonzero) > 0:
        exact = len(nonzero) <= (13 if ties else 50)
        treatment = f"{'ties by midranks' if ties else 'no ties'}, {'exact' if exact else 'normal approximation'}"
        if exact and ties:
            p = scipy.stats.permutation_test((np.sign(nonzero) * ranks,), np.sum, permutation_type="samples",
                                             n_resamples=2**14).pvalue
        else:
            p = scipy.stats.wilcoxon(nonzero, method="exact" if exact else "approx").pvalue
        if len(nonzero) < 6:
            treatment += ", too few hands that differ: p cannot fall below 0.05"
    return float(min(ranks[nonzero > 0].sum(), ranks[nonzero < 0].sum())), float(p), treatment


def compare(observer: str, first: Score, second: Score) -> Comparison:
    """Wilcoxon's test of one observer with two methods, on the shares correct per hand."""
    statistic, p, treatment = signed_ranks(first.per_hand, second.per_hand)
    difference = np.round(np.array(first.per_hand) - second.per_hand, 12)
    return Comparison(observer, first.method, second.method, float(round(difference.mean(), 12)), statistic, p,
                      len(difference), int((difference == 0).sum()), treatment)


def holm(p: list[float]) -> list[float]:
    """p values corrected for their number by Holm's step-down procedure. NaN (no test) is not counted."""
    corrected, largest = [math.nan] * len(p), 0.0
    order = sorted((value, i) for i, value in enumerate(p) if not math.isnan(value))
    for rank, (value, i) in enumerate(order):
        largest = max(largest, (len(order) - rank) * value)
        corrected[i] = min(1.0, largest)
    return corrected


def tally(answers: np.ndarray, label: np.ndarray, number: np.ndarray, hands: int) -> np.ndarray:
    """Answers [sigmas, trials, 3] counted by hand, width meant and width answered: [sigmas, hands, 3, 3]."""
    counted = np.zeros((hands, len(WIDTHS), len(answers), len(WIDTHS)))
    np.add.at(counted, (number, label), answers.transpose(1, 0, 2))
    return counted.transpose(2, 0, 1, 3)


def share_of(counted: np.ndarray) -> np.ndarray:
    """Share correct of counts [..., 3, 3]."""
    return np.trace(counted, axis1=-2, axis2=-1) / counted.sum(axis=(-2, -1))


def refitted(shares: np.ndarray, level: float) -> np.ndarray:
    """Fractional indices at which rows of shares [resamples, sigmas] last fall below the level. If they never do, an end."""
    falls = (shares[:, :-1] >= level) & (shares[:, 1:] < level)
    last = shares.shape[1] - 2 - falls[:, ::-1].argmax(axis=1)
    row = np.arange(len(shares))
    before, after = shares[row, last], shares[row, last + 1]
    part = (before - level) / np.where(before > after, before - after, 1)
    return np.where(falls.any(axis=1), last + part, np.where(shares[:, 0] < level, 0, shares.shape[1] - 1))


def between(values: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Row i of values [resamples, sigmas, ...] at the fractional index position[i]."""
    if values.shape[1] == 1:
        return values[:, 0]
    low = np.clip(np.floor(position).astype(int), 0, values.shape[1] - 2)
    part = (position - low).reshape(-1, *[1] * (values.ndim - 2))
    row = np.arange(len(values))
    return values[row, low] * (1 - part) + values[row, low + 1] * part


def by_thirds(trials: Trials, observer: str, method: str, right: np.ndarray) -> list[dict]:
    """Share correct in each third of the camera's noise. `right` has one value per trial of the method."""
    thirds = np.quantile(trials.noise, [0, 1 / 3, 2 / 3, 1])
    third = np.clip(np.searchsorted(thirds, trials.noise[trials.method == method]) - 1, 0, 2)
    return [{"observer": observer, "method": method, "third": name, "noise_low_mm": float(thirds[k]),
             "noise_high_mm": float(thirds[k + 1]), "trials": int((third == k).sum()),
             "share": float(right[third == k].mean()) if (third == k).any() else math.nan}
            for k, name in enumerate(["lowest", "middle", "highest"])]


def evaluate_observer(trials: Trials, observer: str, sigma: float, fitted: bool, seed: int) -> tuple[list, list, tuple]:
    """Scores and comparisons of one observer, and the interval of its noise.

    The resamples of the hands are the same for every method and observer. A fitted noise is fitted again to each resample, so the
    intervals include the uncertainty of the fit. The observer is not trained again. The middle one of the noises is its own.
    """
    names, label = np.unique(trials.hand), classes(trials)
    sigmas, hands, counts = sigma * FITTED if fitted else np.array([sigma]), len(names), {}
    for method in (m for m in METHODS if (trials.method == m).any()):
        rows = trials.method == method
        answers = answers_of(trials, observer, method, sigmas, seed)
        counts[method] = tally(answers, label[rows], np.searchsorted(names, trials.hand[rows]), hands)
    picks = np.random.default_rng([seed, RESAMPLES]).integers(hands, size=(RESAMPLES, hands))
    weight = (picks[:, :, None] == np.arange(hands)).sum(axis=1).astype(float)
    pooled = {method: np.einsum("bh,shij->bsij", weight, counted) for method, counted in counts.items()}
    position = refitted(share_of(pooled["paper"]), PEOPLE["paper"]) if fitted else np.zeros(RESAMPLES)
    scores, shares = {}, {}
    for method, counted in counts.items():
        own = counted[len(sigmas) // 2]
        shares[method] = share_of(between(pooled[method], position))
        scores[method] = Score(observer, method, float(share_of(own.sum(axis=0))), *np.percentile(shares[method], ENDS).tolist(),
                               hands, int(round(own.sum())), share_of(own).tolist())
    ends = np.percentile(position, ENDS)  # noise grows with it
    comparisons = []
    for first, second in ((a, b) for a, b in PAIRS if a in counts and b in counts):
        found = compare(observer, scores[first], scores[second])
        found.low, found.high = np.percentile(shares[first] - shares[second], ENDS).tolist()
        if fitted:
            found.p_sigma_low, found.p_sigma_high = (signed_ranks(*(share_of(between(counts[method][None], end[None])[0])
                                                                    for method in (first, second)))[1] for end in ends)
        comparisons.append(found)
    return list(scores.values()), comparisons, tuple((sigmas[0] * (sigmas[1] / sigmas[0]) ** ends).tolist()) if fitted else (math.nan, math.nan)


def analyse(trials: Trials, seed: int = 1) -> Result:
    """All observers with every method. `seed` is for the internal noise and the resamples of the hands."""
    methods = [m for m in METHODS if (trials.method == m).any()]
    if len(np.unique(trials.hand)) < 2:
        raise ValueError("leaving one hand out requires two or more hands")
    result = Result({}, {}, {}, [], [], {}, [])
    for observer in OBSERVERS:
        view, sigma, fitted = evened(trials) if observer == EVEN else trials, 0.0, False
        if observer not in NOISELESS:
            curves = result.curves[observer] = {method: right_of(view, observer, method, SIGMAS, seed).mean(axis=1).tolist() for method in methods}
            sigma, fitted = calibrate(view, observer, SIGMAS, np.array(curves["paper"]), seed)
        result.sigma[observer], result.calibrated[observer] = sigma, fitted
        scores, comparisons, result.sigma_interval[observer] = evaluate_observer(view, observer, sigma, fitted, seed)
        result.scores += scores
        result.comparisons += comparisons
        for method in methods:
            result.noise += by_thirds(trials, observer, method, right_of(view, observer, method, np.array([sigma]), seed)[0])
    for comparison, corrected in zip(result.comparisons, holm([c.p for c in result.comparisons])):
        comparison.p_holm = corrected
    return result


def tables(result: Result) -> dict[str, list[dict]]:
    """Rows of widths.csv and widths_wilcoxon, _fit and _noise.csv."""
    def rows(header: list[str], found: list[dict]) -> list[dict]:
        return [{key: f"{row[key]:.6g}" if isinstance(row[key], float) else row[key] for key in header} for row in found]

    return {"widths": rows(["observer", "method", "share", "low", "high", "hands", "trials"], [vars(s) for s in result.scores]),
            "widths_wilcoxon": rows([field.name for field in dataclasses.fields(Comparison)], [vars(c) for c in result.comparisons]),
            "widths_fit": rows(["observer", "sigma", "low", "high", "fitted"], [
                {"observer": observer, "sigma": result.sigma[observer], "low": result.sigma_interval[observer][0],
                 "high": result.sigma_interval[observer][1], "fitted": int(result.calibrated[observer])} for observer in result.curves]),
            "widths_noise": rows(list(result.noise[0]), result.noise)}
