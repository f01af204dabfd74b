"""The results of the observers of the width discrimination, in words."""

import math

from runs import LABELS
from widths import CHANCE, EVEN, IDEAL, OBSERVERS, PEOPLE, RESAMPLES, SIGMAS, Comparison, Result


def covered(result: Result) -> str:
    """What an interval covers, in words."""
    hands = len(result.hands)
    shapes = {0: "", 1: " of one shape"}.get(result.shapes, f" of {result.shapes} shapes")
    even = result.shapes and hands > result.shapes and hands % result.shapes == 0
    sizes = f" at {hands // result.shapes} scales each" if even else ""
    return f"draws of this simulation over {hands} hands{shapes}{sizes}"


def sentences(result: Result) -> list[str]:
    """The findings in words, each computed from the numbers."""
    tests = sum(not math.isnan(c.p) for c in result.comparisons)
    said = [result.note, f"{len(result.hands)} hands, {result.scores[0].trials} trials a method, {result.failed} cases left out"
            f" as failed; published shares of people: {PEOPLE['paper']:.2f} with scattering, {PEOPLE['unscattered']:.2f} without.",
            f"Intervals are of 95 % and cover {covered(result)}, not people and not hands of other shapes: the hands are resampled"
            f" {RESAMPLES:,} times, what an observer was taught is kept. Tests are Wilcoxon's by hand, {tests} of them, corrected"
            " together by Holm's procedure; both p are given."]
    said += fit_sentences(result)
    for observer in OBSERVERS:
        for score in (s for s in result.scores if s.observer == observer):
            if result.calibrated[observer] and score.method == "paper":
                said.append(f"{observer}, {LABELS[score.method]}: {score.share:.2f} correct, which was fitted.")
                continue
            beside = "below" if score.high < CHANCE else "above" if score.low > CHANCE else "not told from"
            said.append(f"{observer}, {LABELS[score.method]}: {score.share:.2f} correct (95 % interval {score.low:.2f} to"
                        f" {score.high:.2f}, {score.hands} hands), {beside} chance.")
        said += [test_sentence(c, tests) for c in result.comparisons if c.observer == observer]
        for method in PEOPLE:
            low, mid, high = (row for row in result.noise if (row["observer"], row["method"]) == (observer, method))
            said.append(f"{observer}, {method}: {low['share']:.2f}, {mid['share']:.2f} and {high['share']:.2f} correct in the thirds"
                        f" of the camera's noise (up to {low['noise_high_mm']:.2f}, {mid['noise_high_mm']:.2f} and"
                        f" {high['noise_high_mm']:.2f} mm RMS).")
    found = {c.observer: c for c in result.comparisons if (c.first, c.second) == ("paper", "unscattered")}
    said.append("In short, with scattering in the solver against without: " + "; ".join(
        f"{observer} " + ("no clear difference" if not c.p_holm < 0.05 else f"{c.difference:+.2f}")
        for observer, c in found.items()) + f"; people {PEOPLE['paper'] - PEOPLE['unscattered']:+.2f}.")
    if IDEAL in found:
        said.append(f"Bringing all patterns to one level moves that difference of the ideal observer from"
                    f" {found[IDEAL].difference:+.2f} to {found[EVEN].difference:+.2f}.")
    return said


def fit_sentences(result: Result) -> list[str]:
    """What the ideal observers do without noise of their own, and with how much they do as people."""
    said = []
    for observer, curves in result.curves.items():
        bare = ", ".join(f"{values[0]:.2f} {method}" for method, values in curves.items())
        said.append(f"Without internal noise the {observer} is right in {bare} (chance {CHANCE:.2f}).")
        sigma, (low, high) = result.sigma[observer], result.sigma_interval[observer]
        if result.calibrated[observer]:
            said.append(f"An internal noise of {sigma:.3g} of the wanted pressure squared (95 % interval {low:.3g} to {high:.3g}, fitted"
                        f" anew to each resample; that people were right in {PEOPLE['paper']:.2f} is taken as exact) makes it as good"
                        " with paper as people were; that was fitted, what the other methods give there is not, and their intervals"
                        " hold what the fit leaves open.")
        else:
            said.append(f"No internal noise from {SIGMAS[1]:g} to {SIGMAS[-1]:g} makes it as good with paper as people were;"
                        f" {sigma:.3g} is taken instead.")
    return said


def test_sentence(c: Comparison, tests: int) -> str:
    size = f"{'better' if c.difference > 0 else 'worse'} than {c.second} by {abs(c.difference):.2f}"
    if abs(c.difference) < 0.005:
        size = f"as good as {c.second} within 0.005"
    clear = "no test, " + c.treatment
    if not math.isnan(c.p):
        clear = (f"{'significant' if c.p_holm < 0.05 else 'not significant'} at 5 %, Wilcoxon p = {c.p_holm:.2g} after Holm's"
                 f" correction for {tests} tests, {c.p:.2g} before, {c.treatment}")
    ends = [f"{p:.2g}" for p in (c.p_sigma_low, c.p_sigma_high) if not math.isnan(p)]
    if len(ends) == 2:
        clear += f"; {ends[0]} and {ends[1]} before it with the internal noise at either end of its interval"
    return (f"{c.observer}: {c.first} is {size} (95 % interval {c.low:+.2f} to {c.high:+.2f}) on {c.hands} hands, {c.zeros} of"
            f" them without a difference ({clear}).")
