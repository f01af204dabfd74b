"""Can boxes of 5, 8 and 11 mm be told apart from the pressure that really arises on the skin?

Input is a folder of hands, each the output of `touchfield sweep scenes/sweeps/widths.yaml`. Observers, each learned on
the other hands and tested on the one left out, answer which of the three widths was meant: one reads a width, one, the
ideal one, sees the whole pattern, as it is or brought to one level for all. They are models: what they tell is what the
device puts on the skin, not what people feel.
"""

import dataclasses
import json
import math
import pathlib

import h5py
import numpy as np
import scipy.stats

from runs import LABELS, table, write_table

WIDTHS = np.array([5.0, 8.0, 11.0])  # mm
CHANCE = 1 / len(WIDTHS)
PEOPLE = {"paper": 0.56, "unscattered": 0.47}  # Matsubayashi, Makino, Shinoda, EuroHaptics 2020
METHODS = ["surface", "paper", "unscattered"]
PAIRS = [("paper", "unscattered"), ("surface", "paper")]
READER, IDEAL, EVEN = "width reader", "ideal observer", "ideal observer, even level"
OBSERVERS = [READER, IDEAL, EVEN]
DRAWS = 20  # of the internal noise, a trial
SIGMAS = np.concatenate([[0], np.geomspace(0.02, 10, 12)])
REACH_MM, CELL_MM, PROFILE_MM = 12, 1.5, 0.5
NOTE = ("This is a model of the device and of an observer, not of people: it shows what the pressure on the skin would let an"
        " observer tell apart, not what anybody feels.")


@dataclasses.dataclass
class Trials:
    """A row a trial and method; `pattern` and `profile` are abs(p)^2 over the wanted pressure squared [1]."""
    hand: np.ndarray  # [N] name of the folder
    width_mm: np.ndarray  # [N] wanted: 5, 8 or 11
    method: np.ndarray  # [N] surface, paper or unscattered
    reading: np.ndarray  # [N] width at half maximum [mm], NaN where there is none
    noise: np.ndarray  # [N] of the sensed surface [mm RMS]
    pattern: np.ndarray  # [N, cells] averages over cells of 1.5 mm
    profile: np.ndarray | None = None  # [N, bins] along x, over abs(y) <= 2 mm
    profile_x: np.ndarray | None = None  # [bins] middles [mm]
    failed: int = 0  # cases left out as their status is not ok


@dataclasses.dataclass
class Score:
    """How one observer did with one method; shares from 0 to 1, `low` to `high` their 95 % confidence interval."""
    observer: str
    method: str
    share: float
    low: float
    high: float
    hands: int
    trials: int
    per_hand: list[float]
    confusion: list[list[float]]  # trials; row: width meant, column: width answered


@dataclasses.dataclass
class Comparison:
    """Wilcoxon's signed-rank test, two-sided, of the shares correct by hand; `difference` is the mean of first - second."""
    observer: str
    first: str
    second: str
    difference: float
    statistic: float  # the smaller sum of ranks
    p: float
    hands: int
    zeros: int  # hands without a difference, which the test drops
    treatment: str


@dataclasses.dataclass
class Result:
    """Everything that `analyse` found; sigma is in units of the wanted pressure squared."""
    note: str
    hands: list[str]
    failed: int
    cells: int
    seed: int
    sigma: dict[str, float]  # of each ideal observer: its headline
    calibrated: dict[str, bool]  # at `sigma` it does with `paper` as well as people did
    scores: list[Score]
    comparisons: list[Comparison]
    sigmas: list[float]
    curves: dict[str, dict[str, list[float]]]  # ideal observer: method: share correct, one a sigma
    noise: list[dict]  # rows: observer, method, third, noise_low_mm, noise_high_mm, share, trials

    def score(self, observer: str, method: str) -> Score:
        return next(s for s in self.scores if (s.observer, s.method) == (observer, method))


def cell_averages(triangles: np.ndarray, area: np.ndarray, value: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Averages by area of one value a face over the cells between the edges x and y [mm]; NaN where no skin is.

    `triangles` [M, 3, 3] in mm. A face is cut in 16 so that it counts in every cell that it touches, by its part there.
    """
    n = 4
    corner = [(i + 1 / 3, j + 1 / 3) for i in range(n) for j in range(n - i)]
    corner += [(i + 2 / 3, j + 2 / 3) for i in range(n - 1) for j in range(n - 1 - i)]
    u, v = np.array(corner).T / n
    points = np.einsum("ck,mkd->mcd", np.stack([1 - u - v, u, v], axis=1), triangles)[..., :2].reshape(-1, 2)
    weight = np.repeat(area, n * n)
    total = np.histogram2d(*points.T, bins=[x, y], weights=weight)[0]
    with np.errstate(invalid="ignore"):
        return np.histogram2d(*points.T, bins=[x, y], weights=weight * np.repeat(value, n * n))[0] / total


def load(hands_folder: str | pathlib.Path) -> Trials:
    """Reads every hand_* of the folder.

    Of the pattern only the cells are kept that have skin on every hand. To fill the others with their neighbours' values
    would show the same skin twice, with fresh internal noise.
    """
    edges = np.arange(-REACH_MM, REACH_MM + CELL_MM / 2, CELL_MM)
    fine = np.arange(-REACH_MM, REACH_MM + PROFILE_MM / 2, PROFILE_MM)
    rows, patterns, profiles, failed = [], [], [], set()
    for folder in sorted(pathlib.Path(hands_folder).glob("hand_*")):
        cases: dict[int, list[dict]] = {}
        for row in table(folder / "sweep.csv"):
            if row["status"] == "ok":
                cases.setdefault(int(row["case"]), []).append(row)
            else:
                failed.add((folder.name, row["case"]))
        for case, lines in cases.items():
            with h5py.File(folder / "cases" / f"{case:05d}" / "run.h5") as run:
                judge = run["judge"]
                corners = 1e3 * judge["mesh/vertices"][:][judge["mesh/triangles"][:]]
                normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                seen = normal[:, 2] < -0.3 * np.linalg.norm(normal, axis=1)
                corners, area = corners[seen], judge["mesh/area"][:][seen]
                wanted = judge["target/amplitude"][:].max()
                for row in lines:
                    energy = np.abs(judge["methods"][row["name"]]["pressure"][:][seen] / wanted) ** 2
                    patterns.append(cell_averages(corners, area, energy, edges, edges).ravel())
                    profiles.append(cell_averages(corners, area, energy, fine, np.array([-2.0, 2.0]))[:, 0])
                    rows.append((folder.name, json.loads(row["target.box.size_mm"])[0], row["name"],
                                 float(row["width_mm"] or "nan"), float(row["sensing.noise_mm_rms"])))
    if not rows:
        raise ValueError(f"{hands_folder}: no case with status ok in any hand_*/sweep.csv")
    hand, width, method, reading, noise = map(np.array, zip(*rows))
    pattern, profile = np.array(patterns), np.array(profiles)
    skin, line = np.isfinite(pattern).all(axis=0), np.isfinite(profile).all(axis=0)
    return Trials(hand, width.astype(float), method, reading, noise, pattern[:, skin], profile[:, line],
                  (fine[:-1] + PROFILE_MM / 2)[line], len(failed))


def evened(trials: Trials) -> Trials:
    """The same with every pattern scaled to one mean: what loudness alone tells is taken away, and an observer's noise
    weighs on every method alike."""
    level = trials.pattern[trials.method == "paper"].mean()
    return dataclasses.replace(trials, pattern=trials.pattern * (level / trials.pattern.mean(axis=1, keepdims=True)))


def shrunk_covariance(residuals: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance of rows of mean 0, shrunk towards a multiple of the identity, and by how much (0 to 1).

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
    """How often an observer who knows the classes answers each of them: [sigmas, trials, classes], shares of the draws.

    It sees a pattern plus sigma times a draw (`draws` [trials, draws, cells], white, variance 1) and answers the class of
    the largest posterior; classes are Gaussian, as likely as each other, of these means and this covariance + sigma^2 I.
    """
    variance, axes = np.linalg.eigh(covariance)
    answers = []
    for sigma in sigmas:
        # The floor lets sigma 0 work where the patterns of a class are all the same.
        weights = means @ axes / (np.maximum(variance, 0) + sigma**2 + 1e-12) @ axes.T
        score = (patterns @ weights.T)[:, None] + sigma * (draws @ weights.T) - (weights * means).sum(axis=1) / 2
        answers.append((score.argmax(axis=2)[..., None] == np.arange(len(means))).mean(axis=1))
    return np.array(answers)


def classes(trials: Trials) -> np.ndarray:
    """Index of the wanted width in WIDTHS, one a row."""
    return np.abs(trials.width_mm[:, None] - WIDTHS).argmin(axis=1)


def ideal_observer(trials: Trials, method: str, sigmas: np.ndarray, seed: int) -> np.ndarray:
    """Answers to the trials of a method in their order, [sigmas, trials, 3]; the internal noise is that of every method."""
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


def width_reader(trials: Trials, method: str) -> np.ndarray:
    """Answers to the trials of a method in their order, [trials, 3]: 1 for the answer, 1/3 each where nothing was read."""
    rows = trials.method == method
    hand, label, reading = trials.hand[rows], classes(trials)[rows], trials.reading[rows]
    answers = np.full((len(hand), len(WIDTHS)), CHANCE)
    for name in np.unique(hand):
        known = (hand != name) & np.isfinite(reading)
        mean = np.array([reading[known & (label == k)].mean() if (known & (label == k)).any() else np.inf
                         for k in range(len(WIDTHS))])
        test = (hand == name) & np.isfinite(reading)
        if np.isfinite(mean).any():
            answers[test] = np.eye(len(WIDTHS))[np.abs(reading[test][:, None] - mean).argmin(axis=1)]
    return answers


def calibrate(trials: Trials, sigmas: np.ndarray, shares: np.ndarray, seed: int) -> tuple[float, bool]:
    """The sigma at which the ideal observer does with `paper` as people did, and whether there is one.

    If there is none, the nearest there is: 0 if it is worse than people even without noise, else the largest.
    """
    sigmas, shares, level = sigmas[1:], shares[1:], PEOPLE["paper"]
    crossings = np.flatnonzero((shares[:-1] >= level) & (shares[1:] < level))
    if len(crossings) == 0:
        return (0.0 if shares[0] < level else float(sigmas[-1])), False
    # The grid is coarse beside the slope there: once more between its two points.
    finer = np.geomspace(sigmas[crossings[-1]], sigmas[crossings[-1] + 1], 9)
    label = classes(trials)[trials.method == "paper"]
    share = ideal_observer(trials, "paper", finer, seed)[:, np.arange(len(label)), label].mean(axis=1)
    last = np.flatnonzero((share[:-1] >= level) & (share[1:] < level))[-1]
    part = (share[last] - level) / (share[last] - share[last + 1])
    return float(finer[last] * (finer[last + 1] / finer[last]) ** part), True


def compare(observer: str, first: Score, second: Score) -> Comparison:
    """Wilcoxon's test by hand. Zeros are dropped; the p value is exact, with ties (midranks) by all signs of up to 13 hands
    and by the normal approximation beyond; NaN if no hand differs."""
    difference = np.round(np.array(first.per_hand) - second.per_hand, 12)
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
    statistic = min(ranks[nonzero > 0].sum(), ranks[nonzero < 0].sum())
    return Comparison(observer, first.method, second.method, float(round(difference.mean(), 12)), float(statistic), float(p),
                      len(difference), int((difference == 0).sum()), treatment)


def analyse(trials: Trials, seed: int = 1) -> Result:
    """Both observers on every method; `seed` is that of the internal noise and of the bootstrap over hands (10,000)."""
    hands, methods = np.unique(trials.hand), [m for m in METHODS if (trials.method == m).any()]
    if len(hands) < 2:
        raise ValueError("leaving one hand out needs two or more hands")
    label, number = classes(trials), np.searchsorted(hands, trials.hand)
    scores, noise = [], []
    views = {IDEAL: trials, EVEN: evened(trials)}
    curves: dict[str, dict[str, list[float]]] = {observer: {} for observer in views}
    sigma, calibrated = {}, {}
    for observer, view in views.items():
        for method in methods:
            right = label[trials.method == method]
            answers = ideal_observer(view, method, SIGMAS, seed)
            curves[observer][method] = answers[:, np.arange(len(right)), right].mean(axis=1).tolist()
        sigma[observer], calibrated[observer] = calibrate(view, SIGMAS, np.array(curves[observer]["paper"]), seed)
    thirds = np.quantile(trials.noise, [0, 1 / 3, 2 / 3, 1])
    for observer in OBSERVERS:
        for method in methods:
            rows = trials.method == method
            answers = (width_reader(trials, method) if observer == READER else
                       ideal_observer(views[observer], method, np.array([sigma[observer]]), seed)[0])
            right = answers[np.arange(rows.sum()), label[rows]]
            count = np.bincount(number[rows], minlength=len(hands))
            correct = np.bincount(number[rows], right, len(hands))
            # The same resamples for every method and observer.
            picks = np.random.default_rng([seed, 10000]).integers(len(hands), size=(10000, len(hands)))
            low, high = np.percentile(correct[picks].sum(axis=1) / count[picks].sum(axis=1), [2.5, 97.5])
            confusion = [answers[label[rows] == k].sum(axis=0).tolist() for k in range(len(WIDTHS))]
            scores.append(Score(observer, method, float(right.mean()), float(low), float(high), len(hands), int(rows.sum()),
                                (correct / count).tolist(), confusion))
            third = np.clip(np.searchsorted(thirds, trials.noise[rows]) - 1, 0, 2)
            for k, name in enumerate(["lowest", "middle", "highest"]):
                noise.append({"observer": observer, "method": method, "third": name, "noise_low_mm": float(thirds[k]),
                              "noise_high_mm": float(thirds[k + 1]), "trials": int((third == k).sum()),
                              "share": float(right[third == k].mean()) if (third == k).any() else math.nan})
    result = Result(NOTE, hands.tolist(), trials.failed, trials.pattern.shape[1], seed, sigma, calibrated, scores, [],
                    SIGMAS.tolist(), curves, noise)
    result.comparisons = [compare(o, result.score(o, a), result.score(o, b)) for o in OBSERVERS for a, b in PAIRS
                          if a in methods and b in methods]
    return result


def write_tables(result: Result, folder: str | pathlib.Path) -> None:
    """Writes widths.csv and widths_confusion, _wilcoxon, _sigma and _noise.csv."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)

    def write(name: str, header: list[str], rows: list[dict]) -> None:
        write_table(folder / f"{name}.csv", [{key: f"{row[key]:.6g}" if isinstance(row[key], float) else row[key]
                                              for key in header} for row in rows])

    write("widths", ["observer", "method", "share", "low", "high", "hands", "trials"], [vars(s) for s in result.scores])
    write("widths_confusion", ["observer", "method", "wanted_mm", "answered_mm", "trials"],
          [{"observer": s.observer, "method": s.method, "wanted_mm": wanted, "answered_mm": answered,
            "trials": s.confusion[i][j]} for s in result.scores
           for i, wanted in enumerate(WIDTHS) for j, answered in enumerate(WIDTHS)])
    write("widths_wilcoxon", [field.name for field in dataclasses.fields(Comparison)],
          [vars(c) for c in result.comparisons])
    write("widths_sigma", ["observer", "sigma", *METHODS],
          [{"observer": observer, "sigma": sigma, **{method: curves[method][i] for method in METHODS}}
           for observer, curves in result.curves.items() for i, sigma in enumerate(result.sigmas)])
    write("widths_noise", list(result.noise[0]), result.noise)


def sentences(result: Result) -> list[str]:
    """The findings in words, each computed from the numbers."""
    said = [result.note, f"{len(result.hands)} hands, {result.scores[0].trials} trials a method, {result.failed} cases left out"
            f" as failed; published shares of people: {PEOPLE['paper']:.2f} with scattering, {PEOPLE['unscattered']:.2f} without."]
    for observer, curves in result.curves.items():
        bare = ", ".join(f"{values[0]:.2f} {method}" for method, values in curves.items())
        said.append(f"Without internal noise the {observer} is right in {bare} (chance {CHANCE:.2f}).")
        sigma = result.sigma[observer]
        if result.calibrated[observer]:
            said.append(f"An internal noise of {sigma:.3g} of the wanted pressure squared makes it as good with paper as people"
                        f" were ({PEOPLE['paper']:.2f}); that was fitted, what the other methods give there is not.")
        else:
            said.append(f"No internal noise from {SIGMAS[1]:g} to {SIGMAS[-1]:g} makes it as good with paper as people were;"
                        f" {sigma:.3g} is taken instead.")
    for observer in OBSERVERS:
        for score in (s for s in result.scores if s.observer == observer):
            beside = "below" if score.high < CHANCE else "above" if score.low > CHANCE else "not told from"
            said.append(f"{observer}, {LABELS[score.method]}: {score.share:.2f} correct (95 % interval {score.low:.2f} to"
                        f" {score.high:.2f}, {score.hands} hands), {beside} chance.")
        for c in (c for c in result.comparisons if c.observer == observer):
            order = "better" if c.difference > 0 else "worse"
            size = f"{order} than {c.second} by {abs(c.difference):.2f}"
            if abs(c.difference) < 0.005:
                size = f"as good as {c.second} within 0.005"
            clear = ("no test, " + c.treatment if math.isnan(c.p) else
                     f"{'significant' if c.p < 0.05 else 'not significant'} at 5 %, Wilcoxon p = {c.p:.2g}, {c.treatment}")
            said.append(f"{observer}: {c.first} is {size} on {c.hands} hands, {c.zeros} of"
                        f" them without a difference ({clear}).")
        for method in PEOPLE:
            low, mid, high = (row for row in result.noise if (row["observer"], row["method"]) == (observer, method))
            said.append(f"{observer}, {method}: {low['share']:.2f}, {mid['share']:.2f} and {high['share']:.2f} correct in the thirds"
                        f" of the camera's noise (up to {low['noise_high_mm']:.2f}, {mid['noise_high_mm']:.2f} and"
                        f" {high['noise_high_mm']:.2f} mm RMS).")
    found = {c.observer: c for c in result.comparisons if (c.first, c.second) == ("paper", "unscattered")}
    said.append("In short, with scattering in the solver against without: " + "; ".join(
        f"{observer} " + ("no clear difference" if not c.p < 0.05 else f"{c.difference:+.2f}")
        for observer, c in found.items()) + f"; people {PEOPLE['paper'] - PEOPLE['unscattered']:+.2f}.")
    if IDEAL in found and abs(found[IDEAL].difference) > abs(found[EVEN].difference):
        said.append("What the ideal observer gains or loses depends more on how loud the patterns are than on their shapes.")
    return said
