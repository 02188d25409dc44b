"""What the diversity of an array of springs is worth."""

import itertools

import numpy as np
from matplotlib.figure import Figure

from mcmj.experiments.linearise.run import Result
from mcmj.pictures.plotting import new_figure
from mcmj.utils.colours import BROWN, GROUP_COLOURS, LILAC, PINK, TARGET_COLOUR


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"linearise": diversity_figure(result)}


def diversity_figure(result: Result) -> Figure:
    """Conditioning and rank of R, and errors of the filter, as the diversity goes to 0."""
    diversities, errors = result.config.diversities, result.errors
    figure = new_figure(13.5, 4.0)
    left, middle, right = figure.subplots(1, 3)
    palette = [*GROUP_COLOURS, LILAC, BROWN, PINK, "0.5"]
    colours = dict(zip(sorted({*result.conditions, *errors}), itertools.cycle(palette)))
    for n, values in result.conditions.items():
        colour = colours[n]
        left.loglog(diversities, values[:-1], "o-", color=colour, ms=4, label=f"{n} springs")
        ranks = np.divide(result.ranks[n][:-1], 2 * n)
        middle.semilogx(diversities, ranks, "o-", color=colour, ms=4, label=f"{n} springs")
    left.axhline(1 / np.finfo(float).eps, color="0.6", ls="--", lw=1)
    left.annotate("1 / rounding error", (min(diversities), 2e15), color="0.4", fontsize=8,
                  va="top")  # fmt: skip
    left.set(ylabel="condition number of R", ylim=(1, 1e22))
    middle.set(ylabel="numerical rank of R / 2n", ylim=(0, 1.08))
    middle.legend(frameon=False, loc="lower right")
    for n, values in errors.items():
        right.loglog(diversities, values[:-1], "o-", color=colours[n], ms=4, label=f"{n} springs")
    equal = max(values[-1] for values in errors.values())
    right.axhline(equal, color=TARGET_COLOUR, ls="--", lw=1, label="equal springs")
    right.set(ylabel="NRMSE (std) on held-out data")
    right.legend(frameon=False, loc="lower left")
    left.set_title("Controllability of the array")
    middle.set_title("2n states are reachable only with diversity")
    right.set_title("The array as a fading memory")
    for axes in (left, middle, right):
        axes.set_xlabel("diversity: stiffness x exp($\\pm$diversity)")
        axes.grid(alpha=0.3)
    return figure
