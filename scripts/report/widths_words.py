"""The results of the observers of the width discrimination, in sentences."""

import math

from runs import counted, listed
from widths import (CHANCE, EVEN, IDEAL, NOISY, NOISY_P, OBSERVERS, PEOPLE, PEOPLE_DIFFERENCE, READ, READER, READER_P, RESAMPLES,
                    SIGMAS, Comparison, Result, is_consistent)

NAMES = {READER: "width reader", READER_P: "width reader of P", NOISY: "width reader with noise of its own",
         NOISY_P: "width reader of P with noise of its own", IDEAL: "ideal observer", EVEN: "ideal observer at even level"}


def covered(result: Result) -> str:
    """The population that an interval covers."""
    hands = len(result.hands)
    shapes = {0: "", 1: " of one shape"}.get(result.shapes, f" of {result.shapes} shapes")
    even = result.shapes and hands > result.shapes and hands % result.shapes == 0
    sizes = f" at {hands // result.shapes} scales each" if even else ""
    return f"draws of this simulation over {hands} hands{shapes}{sizes}"


def sentences(result: Result) -> list[str]:
    """The findings, each computed from the numbers."""
    tests = sum(not math.isnan(c.p) for c in result.comparisons)
    failed = "No case failed."
    if result.failed:
        failed = f"{counted(result.failed, 'case')} failed and {'is' if result.failed == 1 else 'are'} left out."
    thirds = listed([f"{row['noise_high_mm']:.2f}" for row in result.noise[:3]])
    said = [result.note,
            f"There are {counted(len(result.hands), 'hand')} and {counted(result.scores[0].trials, 'trial')} per method. {failed}",
            f"The published shares correct of people are {PEOPLE['paper']:.2f} with scattering (`paper`) and"
            f" {PEOPLE['unscattered']:.2f} without (`unscattered`).",
            f"The 95 % intervals cover {covered(result)}. They do not cover people or hands of other shapes. The hands are resampled"
            f" {RESAMPLES:,} times. The observers are not trained again.",
            "The methods are compared by Wilcoxon's signed-rank test on the shares correct per hand. Holm's procedure corrects p for"
            f" {counted(tests, 'test')} together. Both p, before and after this correction, are given.",
            f"The trials are also grouped into thirds by the camera's noise. The thirds end at {thirds} mm rms."]
    said += fit_sentences(result)
    for observer in OBSERVERS:
        for score in (s for s in result.scores if s.observer == observer):
            share = f"The {NAMES[observer]} is right in {score.share:.2f} of the trials with `{score.method}`."
            if result.calibrated[observer] and score.method == "paper":
                said.append(f"{share} This share was fitted.")
                continue
            position = "is below" if score.high < CHANCE else "is above" if score.low > CHANCE else "includes"
            said.append(f"{share} The 95 % interval over {counted(score.hands, 'hand')}, {score.low:.2f} to {score.high:.2f},"
                        f" {position} chance.")
        said += [test_sentences(c, tests) for c in result.comparisons if c.observer == observer]
        for method in PEOPLE:
            shares = [f"{row['share']:.2f}" for row in result.noise if (row["observer"], row["method"]) == (observer, method)]
            said.append(f"In the thirds of the camera's noise, the {NAMES[observer]} is right in {listed(shares)} with `{method}`.")
    found = {c.observer: c for c in result.comparisons if (c.first, c.second) == ("paper", "unscattered")}
    people = PEOPLE["paper"] - PEOPLE["unscattered"]
    said.append(" ".join([
        f"In short, the share correct with `paper` minus that with `unscattered` is {people:+.2f} for people.",
        *(f"The {NAMES[observer]} shows no clear difference." if not c.p_holm < 0.05 else
          f"For the {NAMES[observer]} it is {c.difference:+.2f}." for observer, c in found.items())]))
    said += consistency_sentences(result, found) + prediction_sentences(result)
    if IDEAL in found:
        said.append("Scaling all patterns to one level changes this difference of the ideal observer from"
                    f" {found[IDEAL].difference:+.2f} to {found[EVEN].difference:+.2f}.")
    return said


def consistency_sentences(result: Result, found: dict[str, Comparison]) -> list[str]:
    """Which observers distinguish the two methods as people do."""
    low, high = PEOPLE_DIFFERENCE
    said = [f"Ten people leave a 95 % interval of {low:.2f} to {high:.2f} on their difference. An observer is consistent with it if its own"
            " difference is within."]
    for observer, c in found.items():
        first, second = (result.score(observer, method).per_hand for method in (c.first, c.second))
        signs = sum(a > b for a, b in zip(first, second))
        parameters = "one fitted parameter" if result.calibrated[observer] else "no fitted parameter"
        said.append(f"The {NAMES[observer]}, with {parameters}, is {'consistent' if is_consistent(result, observer) else 'not consistent'}:"
                    f" {c.difference:+.2f}, and better with `{c.first}` on {signs} of {counted(c.hands, 'hand')}.")
    if is_consistent(result, NOISY_P) and not any(is_consistent(result, observer) for observer in (IDEAL, EVEN)):
        said.append("So the published difference is consistent with one kind of observer, which reads the width of P. Ideal observers of"
                    " the whole pattern do not show it.")
    return said


def prediction_sentences(result: Result) -> list[str]:
    """What the reader of the width of P, whose noise is fitted to people with `paper`, predicts for people with `radiation`."""
    found = next((c for c in result.comparisons if (c.observer, c.first, c.second) == (NOISY_P, "radiation", "paper")), None)
    if found is None or not result.calibrated[NOISY_P]:
        return []
    low, high = PEOPLE_DIFFERENCE
    return [f"Prediction for people: asked as in the published study, they are right in {result.score(NOISY_P, 'radiation').share:.2f} of"
            f" the trials with `radiation`, a difference of {found.difference:+.2f} from `paper` ({found.low:+.2f} to {found.high:+.2f} over"
            f" hands). Ten people leave about {(high - low) / 2:.2f} on either side of a difference. If their interval does not touch that of"
            " the prediction, the observer is refuted."]


def fit_sentences(result: Result) -> list[str]:
    """Shares correct of the observers without noise of their own, and the noise with which they match people."""
    said = []
    for observer, curves in result.curves.items():
        bare = listed([f"{values[0]:.2f} (`{method}`)" for method, values in curves.items()])
        said.append(f"Without internal noise, the {NAMES[observer]} is right in {bare} of the trials. Chance is {CHANCE:.2f}.")
        sigma, (low, high) = result.sigma[observer], result.sigma_interval[observer]
        if result.calibrated[observer]:
            unit = "mm" if observer in READ else "times the squared wanted pressure"
            said.append(f"With an internal noise of {sigma:.3g} {unit}, it is as good with `paper` as people"
                        f" were. The 95 % interval of this noise is {low:.3g} to {high:.3g}. The noise is fitted again to each resample,"
                        f" and the share of people, {PEOPLE['paper']:.2f}, is taken as exact. The results with the other methods are not"
                        " fitted. Their intervals include the uncertainty of the fit.")
        else:
            said.append(f"No internal noise from {SIGMAS[1]:g} to {SIGMAS[-1]:g} makes it as good with `paper` as people were."
                        f" A noise of {sigma:.3g} is used instead.")
    return said


def test_sentences(c: Comparison, tests: int) -> str:
    size = f"{'better' if c.difference > 0 else 'worse'} by {abs(c.difference):.2f} with `{c.first}` than with `{c.second}`"
    if abs(c.difference) < 0.005:
        size = f"as good with `{c.first}` as with `{c.second}` within 0.005"
    said = [f"The {NAMES[c.observer]} is {size}. The difference has a 95 % interval of {c.low:+.2f} to {c.high:+.2f}."]
    if math.isnan(c.p):
        return f"{said[0]} It is 0 on all {counted(c.hands, 'hand')}, so there is no test."
    said.append(f"It is 0 on {c.zeros} of {counted(c.hands, 'hand')}.")
    how, few, _ = c.treatment.partition(", too few hands")
    said.append(f"It is {'significant' if c.p_holm < 0.05 else 'not significant'} at 5 %: Wilcoxon's p is {c.p_holm:.2g} after Holm's"
                f" correction for {counted(tests, 'test')} and {c.p:.2g} before ({how}).")
    if few:
        said.append("Too few hands differ: p cannot fall below 0.05.")
    ends = [f"{p:.2g}" for p in (c.p_sigma_low, c.p_sigma_high) if not math.isnan(p)]
    if len(ends) == 2:
        said.append(f"At the lower and upper end of the interval of the internal noise, p before the correction is {listed(ends)}.")
    return " ".join(said)
