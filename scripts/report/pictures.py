"""Pictures of the report that are drawn from its tables."""

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from delays import AXES  # noqa: E402
from runs import LABELS, STYLES, table  # noqa: E402
from widths import CHANCE, METHODS, OBSERVERS, PEOPLE  # noqa: E402


def percents(rows, key="relative_error"):
    return [100 * float(row[key]) for row in rows]


def of_method(rows, method):
    return [row for row in rows if row["method"] == method]


def convergence(tables):
    rows = table(tables / "convergence.csv")
    drawing, axes = pyplot.subplots(figsize=(7, 4.5), layout="constrained")
    for start, words, style in (("cold", "from zero", {"linewidth": 1.6}),
                                ("warm", "from the previous frame", {"linewidth": 0.9, "markerfacecolor": "white"})):
        for method in dict.fromkeys(row["method"] for row in rows):
            own = [row for row in of_method(rows, method) if row["start"] == start]
            axes.plot([int(row["iterations"]) for row in own], percents(own), **STYLES[method] | style,
                      label=f"{LABELS[method]}, {words}")
    axes.set(xlabel="iterations", ylabel="evaluated error [%]", xlim=(0, 31))
    axes.legend(fontsize=9)
    return drawing


def assumptions(tables):
    rows = table(tables / "assumptions.csv")
    drawing, axes = pyplot.subplots(figsize=(8, 0.8 + 0.27 * len(rows)), layout="constrained")
    for method in ("surface", "paper", "unscattered", "focus"):
        axes.plot(percents(rows, method), range(len(rows)), color=STYLES[method]["color"], marker=STYLES[method]["marker"],
                  linestyle="none", label=LABELS[method])
    axes.set_yticks(range(len(rows)), [row["change"] for row in rows])
    axes.set(xlabel="evaluated error [%]", ylim=(len(rows) - 0.5, -0.5))
    axes.grid(axis="y", color="0.9")
    axes.set_axisbelow(True)
    axes.legend(fontsize=9, ncol=2, loc="lower center", bbox_to_anchor=(0.5, 1))
    return drawing


def widths(tables):
    rows = table(tables / "widths.csv")
    drawing, axes = pyplot.subplots(figsize=(9, 4.8), layout="constrained")
    for k, method in enumerate(METHODS):
        own = {row["observer"]: [float(row[key]) for key in ("share", "low", "high")] for row in of_method(rows, method)}
        share, low, high = zip(*(own[observer] for observer in OBSERVERS))
        places = [group + 0.16 * (k - 1.5) for group in range(len(OBSERVERS))]
        axes.errorbar(places, share, [[max(0, a - b) for a, b in zip(share, low)], [max(0, b - a) for a, b in zip(share, high)]],
                      color=STYLES[method]["color"], marker=STYLES[method]["marker"], linestyle="none", capsize=3, label=LABELS[method])
        if method in PEOPLE:
            axes.plot(len(OBSERVERS) + 0.16 * (k - 2.5), PEOPLE[method], color=STYLES[method]["color"], marker=STYLES[method]["marker"],
                      fillstyle="none", markersize=9)
    axes.axhline(CHANCE, color="0.4", linewidth=1, dashes=(6, 4), label="chance")
    axes.set(ylim=(0, 1.04), ylabel="share of answers correct [1]")
    axes.set_xticks(range(len(OBSERVERS) + 1), [*(name.replace(", ", ",\n").replace(" of ", "\nof ") for name in OBSERVERS), "people\n(published)"])
    axes.legend(fontsize=9, ncol=2, loc="lower left")
    return drawing


def delays(tables):
    rows = table(tables / "delays_by_displacement.csv")
    drawing, panels = pyplot.subplots(1, len(AXES), figsize=(12, 3.8), layout="constrained", sharey=True)
    for axes, (axis, words) in zip(panels, AXES.items()):
        for method in dict.fromkeys(row["method"] for row in rows):
            own = [row for row in of_method(rows, method) if row["axis"] == axis]
            axes.plot([float(row["displacement_mm"]) for row in own], percents(own), **STYLES[method] | {"markersize": 4},
                      label=LABELS[method])
        axes.set(title=words, xlabel="displacement since the sample [mm]", xlim=(0, 10))
        axes.grid(color="0.9")
    panels[0].set_ylabel("evaluated error [%]")
    panels[0].legend(fontsize=9)
    return drawing


def draw(tables, folder):
    """Draws every picture whose table is there."""
    for picture, name in ((convergence, "convergence"), (assumptions, "assumptions"), (widths, "widths"), (delays, "delays_by_displacement")):
        if (tables / f"{name}.csv").exists():
            drawing = picture(tables)
            drawing.savefig(folder / f"{picture.__name__}.png", dpi=90)
            pyplot.close(drawing)
