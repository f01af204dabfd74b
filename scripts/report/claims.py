"""Compares the published statements with the results here, and lists the assumptions of each comparison."""

from delays import AXES
from runs import SCENES, number, percent
from widths import NOISY_P, PEOPLE, PEOPLE_DIFFERENCE

HEADER = ["published statement", "result here", "verdict", "assumptions"]
PUBLISHED_MS = 10  # per iteration at 10,000 faces and 1,496 transducers, on a graphics card


def nearer(metrics, known, without):
    """Number of scenes with a lower error if the solver includes scattering, the reduction, and the verdict."""
    error = {(row["scene"], row["method"]): float(row["relative_error"]) for row in metrics}
    gains = [100 * (error[name, without] - error[name, known]) for name in SCENES]
    count = sum(gain > 0 for gain in gains)
    return (f"the error is lower on {count} of {len(gains)} scenes (reduction of {min(gains):.1f} to {max(gains):.1f} points)",
            "holds" if count == len(gains) else "fails" if count == 0 else "holds in part")


def discrimination(shares):
    """Share correct of the reader of the width of P, from rows of widths.csv, and the verdict."""
    right = {row["method"]: float(row["share"]) for row in shares if row["observer"] == NOISY_P}
    low, high = PEOPLE_DIFFERENCE
    return (f"an observer that reads the width of the radiation pressure with noise of its own (one parameter, fitted) is correct in "
            f"{right['paper']:.2f} with scattering, {right['unscattered']:.2f} without; ten people leave {low:.2f} to {high:.2f} on the "
            "difference", "consistent" if low <= right["paper"] - right["unscattered"] <= high else "not consistent")


def rows(metrics, convergence, by_faces, shares, delays):
    """One row per published statement, from metrics.csv, convergence.csv, iteration_faces.csv, widths.csv and delays.csv."""
    said, verdict = nearer(metrics, "paper", "unscattered")
    found = [["scattering in the solver lowers the error of the pattern", said, verdict,
              "faces are weighted by area; the hand is rigid and has published proportions"]]
    said, verdict = nearer(metrics, "paper_original", "unscattered_original")
    found.append(["the same, with the published scattering model and weights", said, verdict,
                  "the phases are evaluated on a finer mesh with this program's model"])
    said, verdict = discrimination(shares) if shares else ("not computed with this revision", "open")
    found.append([f"people distinguish 5, 8 and 11 mm: {PEOPLE['paper']:.2f} correct with scattering, "
                  f"{PEOPLE['unscattered']:.2f} without", said, verdict,
                  "a model observer replaces people; the depth camera has noise; perception is not modelled"])
    warm = {int(row["iterations"]): float(row["relative_error"]) for row in convergence
            if (row["start"], row["method"]) == ("warm", "paper")}
    five, last = min(warm, key=lambda count: abs(count - 5)), max(warm)
    found.append(["a few iterations are enough if they start from the previous frame",
                  f"the error of `paper` is {percent(warm[five])} after {five} iterations, {percent(warm[last])} after {last}",
                  "holds" if warm[five] - warm[last] < 0.01 else "fails", "the hand moves by 1 mm between the frames"])
    largest = max(by_faces, key=lambda row: int(row["faces"]))
    took = float(largest["paper_ms_an_iteration"])
    found.append([f"an iteration takes {PUBLISHED_MS} ms at 10,000 faces and 1,496 transducers on a graphics card",
                  f"{number(took)} ms at {int(largest['faces']):,} faces on this processor",
                  "holds" if took <= PUBLISHED_MS and int(largest["faces"]) >= 10000 else "not compared: different machine",
                  "preparation is not included"])
    slow = {row["axis"]: row for row in delays if (row["method"], row["predict"], float(row["speed_mm_s"])) == ("surface", "none", 50)
            and float(row["array_ms"]) == 0}
    if slow:
        worst = max(slow.values(), key=lambda row: float(row["error_mean"]))
        found.append(["20 frames per second can follow a hand that is measured 30 times per second",
                      f"at 50 mm/s {AXES[worst['axis']]}, `surface` has a mean error of {percent(worst['error_mean'])}; its phases are "
                      f"{number(worst['age_ms_mean'])} ms old on average", "depends on the speed", "solving takes no time"])
    return found
