"""Cost, evaluated error and time of the iterations, and time and error of the schemes."""

import re

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from runs import LABELS, STYLES, attributes, cases, costs, number, percent, size_of, table  # noqa: E402

METHODS = ["surface", "paper", "unscattered"]
MARKED = (5, 10, 30)  # numbers of iterations in the published study


def errors(folder):
    """{method: (iterations, evaluated errors)} of a run that has METHOD_NN for several NN."""
    found = {}
    for name, known in attributes(folder).items():
        method, count = name.rsplit("_", 1)
        found.setdefault(method, []).append((int(count), float(known["relative_error"])))
    return {method: tuple(zip(*sorted(points))) for method, points in found.items()}


def longest_costs(folder):
    """{method: cost before the first and after each iteration} of the longest run of each method."""
    found = {}
    for name, cost in costs(folder).items():
        method = name.rsplit("_", 1)[0]
        if len(cost) > len(found.get(method, [])):
            found[method] = cost
    return found


def convergence_rows(work):
    rows = []
    for start in ("cold", "warm"):
        found = longest_costs(work / "convergence" / start)
        for method, (counts, values) in errors(work / "convergence" / start).items():
            cost = found[method]
            for count, value in zip(counts, values):
                rows.append({"start": start, "method": method, "iterations": count, "relative_error": f"{value:.9g}",
                             "cost": f"{cost[min(count, len(cost) - 1)]:.9g}"})
    return rows


def convergence_figure(work, path):
    drawing, (left, right) = pyplot.subplots(1, 2, figsize=(13, 4.8), layout="constrained")
    found = {start: longest_costs(work / "convergence" / start) for start in ("cold", "warm")}
    for start, filled in (("cold", True), ("warm", False)):
        for method, (counts, values) in errors(work / "convergence" / start).items():
            style = STYLES[method] | {"markerfacecolor": STYLES[method]["color"] if filled else "white",
                                      "label": f"{LABELS[method]}, " + ("from zero" if filled else "from the previous frame"),
                                      "linewidth": 1.6 if filled else 0.9}
            cost = found[start][method]
            least = min(one[method].min() for one in found.values())
            marks = [count for count in MARKED if count < len(cost)]
            above = numpy.where(cost > least, cost / least - 1, numpy.nan)  # a logarithmic scale has no place for 0
            left.plot(numpy.arange(len(cost)), above, **style, markevery=marks)
            right.plot(counts, 100 * numpy.array(values), **style,
                       markevery=[i for i, count in enumerate(counts) if count in MARKED])
    for axes in (left, right):
        for count in MARKED:
            axes.axvline(count, color="0.85", zorder=0)
        axes.set_xlabel("iteration (marked: 5, 10 and 30)")
        axes.set_xlim(0, 31)
    left.set_yscale("log")
    left.set_ylabel("cost above the least of the method, relative")
    right.set_ylabel("evaluated error [%]")
    right.legend(fontsize=9)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)


def from_there_on(counts, values, last, within=0.005):
    """The first count from which all values are within reach of `last`. None if the final value is not."""
    found = None
    for count, value in zip(counts, values):
        near = abs(value - last) < within
        found = (count if found is None else found) if near else None
    return found


def convergence_sentences(rows):
    """Sentences from rows of convergence.csv."""
    said = []
    for method in METHODS:
        points = {start: [(int(row["iterations"]), float(row["relative_error"])) for row in rows
                          if (row["method"], row["start"]) == (method, start)] for start in ("cold", "warm")}
        final, last = points["cold"][-1]

        def stays(start, value):
            found = from_there_on(*zip(*points[start]), last)
            return f"does not stay within half a percentage point of {value}" if found is None else \
                f"is within half a percentage point of {value} from iteration {found} onwards"

        said.append(f"`{method}` has an evaluated error of {percent(last)} after {final} iterations from zero. "
                    f"From zero, the error {stays('cold', 'this value')}. From the previous frame, it {stays('warm', 'it')}. "
                    f"The tried numbers of iterations are {', '.join(str(count) for count, _ in points['cold'])}.")
    return said


def iteration_times(folder):
    """Times of an iteration and of the preparation, from runs of few and of many steps. One row per case."""
    rows = []
    for case in cases(folder):
        known = attributes(case)
        faces, channels, targets = size_of(case)
        row = {"faces": faces, "channels": channels, "target_faces": targets}
        for method in ("surface", "paper"):
            few, many = known[f"{method}_10"], known[f"{method}_30"]
            steps = float(many["steps"]) - float(few["steps"])
            a_step = (many["seconds_solve"] - few["seconds_solve"]) / steps if steps > 0 else numpy.nan
            row[f"{method}_ms_an_iteration"] = f"{1e3 * a_step:.3g}"
        row["surface_once_s"] = f"{known['once']['seconds_solve']:.3g}"
        row["paper_once_s"] = f"{known['paper_once']['seconds_solve']:.3g}"
        rows.append(row)
    return rows


def spread(rows, column, unit):
    values = [float(row[column]) for row in rows]
    return f"{number(min(values))} to {number(max(values))} {unit}"


def times_sentences(by_faces, by_channels):
    """Sentences from both tables: time per iteration, time of the preparation."""
    said = []
    for rows, key in ((by_faces, "faces"), (by_channels, "channels")):
        factor = int(rows[-1][key]) / int(rows[0][key])
        of_surface, of_paper = (f"from {number(rows[0][column])} to {number(rows[-1][column])} ms "
                                f"(all cases: {spread(rows, column, 'ms')})"
                                for column in ("surface_ms_an_iteration", "paper_ms_an_iteration"))
        said.append(f"From {rows[0][key]} to {rows[-1][key]} {key} ({factor:.1f} times as many), the time per iteration of `surface` "
                    f"changes {of_surface}. That of `paper` changes {of_paper}. The time of preparation and first iteration changes "
                    + " and ".join(f"from {number(rows[0][column])} to {number(rows[-1][column])} s for `{method}`"
                                   for method in ("surface", "paper") for column in (f"{method}_once_s",)) + ".")
    return said


def times_figure(by_faces, by_channels, path):
    drawing, all_axes = pyplot.subplots(1, 2, figsize=(12, 4.4), layout="constrained")
    for axes, rows, key, label in ((all_axes[0], by_faces, "faces", "faces of the body"),
                                   (all_axes[1], by_channels, "channels", "transducers")):
        for method in ("surface", "paper"):
            axes.plot([row[key] for row in rows], [float(row[f"{method}_ms_an_iteration"]) for row in rows],
                      **STYLES[method], label=LABELS[method])
        axes.set_xlabel(label)
        axes.set_ylabel("time per iteration [ms]")
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        axes.legend()
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)


def study_rows(work):
    return [row for row in table(work / "study" / "study.csv") if row["status"] == "ok"]


def study_figure(work, path):
    rows = study_rows(work)
    markers = dict(zip(sorted({row["scheme"] for row in rows}), "osD^v"))
    drawing, axes = pyplot.subplots(figsize=(9, 5.2), layout="constrained")
    for scheme, marker in markers.items():
        own = [row for row in rows if row["scheme"] == scheme]
        axes.scatter([float(row["seconds"]) for row in own], [100 * float(row["error_reference"]) for row in own],
                     marker=marker, s=42, facecolors=["0.25" if row["pareto"] == "1" else "white" for row in own],
                     edgecolors="0.25")
        axes.scatter([], [], marker=marker, s=42, facecolors="white", edgecolors="0.25", label=scheme)
    best = sorted((float(row["seconds"]), 100 * float(row["error_reference"])) for row in rows if row["pareto"] == "1")
    axes.plot(*zip(*best), color="0.25", linewidth=0.9, label="Pareto front (filled)")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("time to solve [s]")
    axes.set_ylabel("relative error of the pressure on the skin [%]")
    axes.legend(fontsize=9)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)


def study_table(work):
    """Header and rows of the Pareto front: no other row is both faster and more accurate."""
    best = sorted((row for row in study_rows(work) if row["pareto"] == "1"), key=lambda row: float(row["seconds"]))
    header = ["scheme", "edge [mm]", "faces", "precision", "solver", "seconds", "error"]
    return header, [[row["scheme"], f"{float(row['edge_mm']):.2f}", row["faces"], row["precision"], row["solver"],
                     f"{float(row['seconds']):.2g}", percent(row["error_reference"], 2)] for row in best]


def processor():
    with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
        found = re.search(r"^model name\s*: (.*)$", file.read(), re.M)
    return found[1] if found else "unknown processor"
