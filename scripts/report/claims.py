"""Compares the published statements with the results here, and lists the assumptions of each comparison."""

from delays import AXES
from runs import SCENES, percent
from widths import NOISY_P, PEOPLE, PEOPLE_DIFFERENCE

PUBLISHED_MS = 10  # per iteration at 10,000 faces and 1,496 transducers, on a graphics card


def nearer(rows, known, without, column="relative_error"):
    """Number of scenes with a lower error if the solver includes scattering, the reduction, and the verdict."""
    error = {(row["scene"], row["method"]): float(row[column]) for row in rows}
    gains = [100 * (error[name, without] - error[name, known]) for name in SCENES if (name, known) in error]
    count = sum(gain > 0 for gain in gains)
    return (f"lower on {count} of {len(gains)} scenes, by {min(gains):.1f} to {max(gains):.1f} points",
            "holds" if count == len(gains) else "fails" if count == 0 else "holds in part")


def discrimination(widths):
    """Share correct of the reader of the width of P, and the verdict."""
    right = {row["method"]: float(row["share"]) for row in widths if row["observer"] == NOISY_P}
    low, high = PEOPLE_DIFFERENCE
    return (f"a reader of the width of P with one fitted noise: {right['paper']:.2f} with scattering, {right['unscattered']:.2f} without; "
            f"ten people leave {low:.2f} to {high:.2f} on the difference", "consistent" if low <= right["paper"] - right["unscattered"] <= high else "not consistent")


def few_iterations(convergence):
    warm = {int(row["iterations"]): float(row["relative_error"]) for row in convergence
            if (row["start"], row["method"]) == ("warm", "paper")}
    five, last = min(warm, key=lambda count: abs(count - 5)), max(warm)
    return (f"the error of `paper` is {percent(warm[five])} after {five} iterations, {percent(warm[last])} after {last}",
            "holds" if warm[five] - warm[last] < 0.01 else "fails")


def iteration_time(by_faces):
    largest = max(by_faces, key=lambda row: int(row["faces"]))
    took = float(largest["paper_ms_an_iteration"])
    return (f"{took:.3g} ms at {int(largest['faces']):,} faces with {largest['threads']} threads of {largest['processor']}",
            "holds" if took <= PUBLISHED_MS and int(largest["faces"]) >= 10000 else "not compared: different machine")


def following(delays):
    slow = [row for row in delays if (row["method"], row["predict"], float(row["speed_mm_s"]), float(row["array_ms"]))
            == ("surface", "none", 50, 0)]
    worst = max(slow, key=lambda row: float(row["error_mean"]))
    return (f"at 50 mm/s {AXES[worst['axis']]}, `surface` has a mean error of {percent(worst['error_mean'])} with phases "
            f"{float(worst['age_ms_mean']):.3g} ms old", "depends on the speed")


# Table, statement, its result and verdict from that table, assumptions.
CLAIMS = [
    ("metrics", "scattering in the solver lowers the error of the pattern", lambda rows: nearer(rows, "paper", "unscattered"),
     "faces weighted by area; a rigid hand with an arm"),
    ("metrics", "the same, with the published scattering model and weights",
     lambda rows: nearer(rows, "paper_original", "unscattered_original"),
     "evaluated with this program's model on a finer mesh"),
    ("forearm", "the same, on a hand that ends at the wrist", lambda rows: nearer(rows, "paper_original", "unscattered_original", "error_alone"),
     "no arm, as published"),
    ("widths", f"people distinguish 5, 8 and 11 mm: {PEOPLE['paper']:.2f} correct with scattering, {PEOPLE['unscattered']:.2f} without",
     discrimination, "a model observer and a noisy camera; no perception"),
    ("convergence", "a few iterations are enough if they start from the previous frame", few_iterations,
     "a motion of 1 mm between frames"),
    ("iteration_faces", f"an iteration takes {PUBLISHED_MS} ms at 10,000 faces and 1,496 transducers on a graphics card", iteration_time,
     "without preparation"),
    ("delays", "20 frames per second can follow a hand measured 30 times per second", following, "no time for solving")]


def rows(tables):
    """One row per published statement, from {name: rows of a table}; a statement without its table is open."""
    found = []
    for name, statement, result, assumptions in CLAIMS:
        said, verdict = result(tables[name]) if name in tables else ("not computed", "open")
        found.append({"statement": statement, "result": said, "verdict": verdict, "assumptions": assumptions})
    return found
