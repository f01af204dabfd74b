"""Compares the published statements with the results here, and lists the assumptions of each comparison."""

from runs import SCENES, number, percent
from widths import PEOPLE, READER

HEADER = ["published", "here", "verdict", "taken for granted"]
PUBLISHED_MS = 10  # an iteration at 10,000 faces and 1,496 transducers, on a graphics card


def nearer(metrics, known, without):
    """On how many scenes the error is lower with scattering, and by how much."""
    error = {(row["scene"], row["method"]): float(row["relative_error"]) for row in metrics}
    gains = [100 * (error[name, without] - error[name, known]) for name in SCENES]
    count = sum(gain > 0 for gain in gains)
    return (f"the error is lower on {count} of {len(gains)} scenes, by {min(gains):.1f} to {max(gains):.1f} points",
            "holds" if count == len(gains) else "fails" if count == 0 else "holds in part")


def discrimination(shares):
    """What the reader of widths gets right, of rows of widths.csv."""
    right = {row["method"]: float(row["share"]) for row in shares if row["observer"] == READER}
    off = max(abs(right[method] - share) for method, share in PEOPLE.items())
    alike = right["paper"] > right["unscattered"]
    verdict = "explained" if off < 0.05 and alike else "not explained"
    return f"an observer who reads the width is right in {right['paper']:.2f} and {right['unscattered']:.2f}", verdict


def rows(metrics, convergence, by_faces, shares, delays):
    """Of metrics.csv, convergence.csv, iteration_faces.csv, widths.csv and delays.csv."""
    said, verdict = nearer(metrics, "paper", "unscattered")
    found = [["a model of scattering in the solver brings the pattern nearer to the wanted one", said, verdict,
              "faces by area; a rigid hand of published proportions"]]
    said, verdict = nearer(metrics, "paper_original", "unscattered_original")
    found.append(["the same, with the model of scattering and the weights as published", said, verdict,
                  "phases by that model, judged by a finer mesh of ours"])
    said, verdict = discrimination(shares) if shares else ("not computed of this revision", "open")
    found.append([f"people tell 5, 8 and 11 mm apart: {PEOPLE['paper']:.2f} right with scattering, "
                  f"{PEOPLE['unscattered']:.2f} without", said, verdict,
                  "an observer is no person; noise of a depth camera; no feeling modelled"])
    warm = {int(row["iterations"]): float(row["relative_error"]) for row in convergence
            if (row["start"], row["method"]) == ("warm", "paper")}
    five, last = min(warm, key=lambda count: abs(count - 5)), max(warm)
    found.append(["a few iterations from the frame before are enough",
                  f"`paper`: {percent(warm[five])} after {five}, {percent(warm[last])} after {last}",
                  "holds" if warm[five] - warm[last] < 0.01 else "fails", "a hand that moved by 1 mm since"])
    largest = max(by_faces, key=lambda row: int(row["faces"]))
    took = float(largest["paper_ms_an_iteration"])
    found.append([f"an iteration takes {PUBLISHED_MS} ms at 10,000 faces and 1,496 transducers on a graphics card",
                  f"{number(took)} ms at {int(largest['faces']):,} faces on this processor",
                  "holds" if took <= PUBLISHED_MS and int(largest["faces"]) >= 10000 else "not compared: another machine",
                  "what comes once is not in it"])
    slow = {row["axis"]: row for row in delays if (row["method"], row["predict"], float(row["speed_mm_s"])) == ("surface", "none", 50)
            and float(row["array_ms"]) == 0}
    if slow:
        worst = max(slow.values(), key=lambda row: float(row["error_mean"]))
        found.append(["a hand seen 30 times a second can be followed at 20 frames a second",
                      f"at 50 mm/s {worst['axis']} the hand `surface` is off by {percent(worst['error_mean'])} on average, "
                      f"{number(worst['age_ms_mean'])} ms late", "depends on the speed", "solving takes no time"])
    return found
