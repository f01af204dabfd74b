"""The figure of the width discrimination: shares correct, internal noise, confusions, profiles."""

import pathlib

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from runs import LABELS, STYLES  # noqa: E402
from widths import CHANCE, EVEN, IDEAL, METHODS, NOISY, NOISY_P, OBSERVERS, PEOPLE, READ, READER, READER_P, Result  # noqa: E402
from widths_trials import WIDTHS, Trials, classes  # noqa: E402

TICKS = {READER: "width", READER_P: "width of P", NOISY: "width", NOISY_P: "width of P", IDEAL: "ideal", EVEN: "ideal,\neven level"}
TITLE = {"loc": "left", "fontweight": "bold", "fontsize": 12}


def draw_shares(axes, result: Result, methods: list[str]) -> None:
    for group, observer in enumerate(OBSERVERS):
        for k, method in enumerate(methods):
            score, style = result.score(observer, method), STYLES[method]
            x = group + 0.21 * (k - (len(methods) - 1) / 2)
            spread = np.linspace(-0.045, 0.045, len(score.per_hand))
            axes.plot(x - 0.07 + spread / 2, score.per_hand, ".", color="0.6", markersize=5, zorder=1)
            axes.errorbar(x + 0.03, score.share, [[max(0, score.share - score.low)], [max(0, score.high - score.share)]],
                          color=style["color"], marker=style["marker"], markersize=9, capsize=4,
                          label=LABELS[method] if group == 0 else None)
    for k, (method, share) in enumerate(PEOPLE.items()):
        x = len(OBSERVERS) + 0.24 * (k - 0.5)
        axes.plot(x, share, STYLES[method]["marker"], color=STYLES[method]["color"], fillstyle="none", markersize=10,
                  markeredgewidth=1.6)
        axes.annotate(f"{share:.2f}", (x, share), (0, 11), textcoords="offset points", ha="center")
    axes.plot([], [], ".", color="0.6", label="one hand")
    axes.axhline(CHANCE, color="0.4", linewidth=1, dashes=(6, 4))
    axes.text(len(OBSERVERS) + 0.42, CHANCE - 0.012, "chance", color="0.3", ha="right", va="top")
    axes.set(xlim=(-0.5, len(OBSERVERS) + 0.45), ylim=(0, 1.04), ylabel="share of answers correct [1]",
             xticks=range(len(OBSERVERS) + 1),
             xticklabels=[TICKS[observer] + (f",\n$\\sigma$ = {result.sigma[observer]:.2g}{' mm' if observer in READ else ''}"
                                             if observer in result.curves else "\nalone") for observer in OBSERVERS]
             + ["people\n(published)"])
    axes.tick_params(axis="x", labelsize=9)
    axes.legend(loc="lower left", ncol=2, columnspacing=1.2, handletextpad=0.4)
    axes.set_title("(a) share of answers correct, with 95 % intervals", **TITLE)


def draw_noise(axes, result: Result) -> None:
    for observer, filled in ((IDEAL, True), (EVEN, False)):
        for method, values in result.curves[observer].items():
            axes.plot(result.sigmas[1:], values[1:], **STYLES[method], linewidth=1.6 if filled else 0.9,
                      markerfacecolor=STYLES[method]["color"] if filled else "white",
                      label=LABELS[method] + ("" if filled else ", even level"))
        if result.calibrated[observer]:
            axes.plot(result.sigma[observer], PEOPLE["paper"], "o", color="k", fillstyle="none", markersize=17)
            axes.plot(result.sigma_interval[observer], [PEOPLE["paper"]] * 2, "k|-", linewidth=1.4, markersize=12)
    axes.axhline(PEOPLE["paper"], color="0.8", linewidth=1, zorder=0)
    axes.text(result.sigmas[1], PEOPLE["paper"] + 0.01, "people, with scattering", color="0.3")
    axes.axhline(CHANCE, color="0.4", linewidth=1, dashes=(6, 4))
    axes.text(result.sigmas[-1], CHANCE - 0.012, "chance", color="0.3", ha="right", va="top")
    axes.set(xscale="log", ylim=(0, 1.04), ylabel="share of answers correct [1]",
             xlabel=r"internal noise $\sigma$ per cell [wanted pressure$^2$]")
    axes.legend(loc="lower left", fontsize=9)
    axes.set_title("(b) ideal observers by internal noise (circles: fitted)", **TITLE)


def draw_confusions(page, grid, result: Result) -> None:
    parts = grid.subgridspec(1, 2, wspace=0.12)
    for k, method in enumerate(PEOPLE):
        axes = page.add_subplot(parts[k])
        score = result.score(EVEN, method)
        confusion = np.array(score.confusion)
        confusion /= confusion.sum(axis=1, keepdims=True)
        axes.imshow(confusion, cmap="Greys", vmin=0, vmax=1)
        for (i, j), share in np.ndenumerate(confusion):
            axes.text(j, i, f"{share:.2f}\n{score.confusion_low[i][j]:.2f} to {score.confusion_high[i][j]:.2f}", ha="center",
                      va="center", color="w" if share > 0.5 else "k", fontsize=10)
        ticks = [f"{width:g}" for width in WIDTHS]
        axes.set(xticks=range(3), yticks=range(3), xticklabels=ticks, yticklabels=ticks if k == 0 else [],
                 xlabel="width answered [mm]", ylabel="width meant [mm]" if k == 0 else "")
        axes.tick_params(length=0)
        axes.set_title(LABELS[method], fontsize=11)
        if k == 0:
            axes.text(0, 1.15, f"(c) answers of the ideal observer at even level, $\\sigma$ = {result.sigma[EVEN]:.2g}",
                      transform=axes.transAxes, fontsize=12, fontweight="bold")


def draw_profiles(page, grid, trials: Trials) -> None:
    parts, first = grid.subgridspec(1, 3, wspace=0.1), None
    for k, width in enumerate(WIDTHS):
        axes = first = page.add_subplot(parts[k], sharey=first)
        axes.axvspan(-width / 2, width / 2, color="0.92", label="wanted")
        for method in METHODS:
            rows = (trials.method == method) & (classes(trials) == k)
            if rows.any():
                axes.plot(trials.profile_x, trials.profile[rows].mean(axis=0), **STYLES[method], markersize=4,
                          label=LABELS[method])
        axes.set(xlabel="x [mm]", ylabel=r"mean $|p|^2$ [wanted pressure$^2$]" if k == 0 else "")
        axes.tick_params(labelleft=k == 0)
        axes.set_title(f"{width:g} mm", fontsize=11)
        if k == 0:
            axes.text(0, 1.22, r"(d) mean $|p|^2$ on the skin along x, $|y| \leq$ 2 mm", transform=axes.transAxes,
                      fontsize=12, fontweight="bold")
        if k == 1:
            axes.set_ylim(bottom=0)
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.07), ncol=3, fontsize=9, columnspacing=1)


def figure(result: Result, trials: Trials, path_png: str | pathlib.Path) -> None:
    """One picture of 1500 x 1100 pixels. `trials` must have profiles."""
    with pyplot.rc_context({"font.size": 11, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False}):
        page = pyplot.figure(figsize=(15, 11), dpi=100)
        grid = page.add_gridspec(2, 2, left=0.06, right=0.985, top=0.955, bottom=0.065, wspace=0.16, hspace=0.46)
        draw_shares(page.add_subplot(grid[0, 0]), result, list(result.curves[IDEAL]))
        draw_noise(page.add_subplot(grid[0, 1]), result)
        draw_confusions(page, grid[1, 0], result)
        draw_profiles(page, grid[1, 1], trials)
        page.savefig(path_png)
        pyplot.close(page)
