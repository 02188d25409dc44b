"""A readout of a recording: held-out outputs on their targets, the signals' spectrum, memory."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.fit.result import Result, Worth
from mcmj.pictures.plotting import OUTPUT_STYLES, TARGET_STYLE, count_in_whole_numbers, new_figure
from mcmj.utils.colours import BLUE, GROUP_COLOURS

MOST_TARGETS = 6  # drawn; the table has all


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"fit": fit_figure(result)}


def fit_figure(result: Result) -> Figure:
    """A row a target, held out; below, the spectrum of the signals and capacities by delay."""
    shown = result.target_names[:MOST_TARGETS]
    figure = new_figure(11.0, 2.0 * len(shown) + 3.4)
    grid = figure.add_gridspec(len(shown) + 1, 2, height_ratios=[1.0] * len(shown) + [1.4])
    for row, name in enumerate(shown):
        axes = figure.add_subplot(grid[row, :])
        axes.plot(result.times, result.wanted[:, row], **TARGET_STYLE, label="target")
        axes.plot(result.times, result.outputs[:, row], lw=1.2, **OUTPUT_STYLES[1], label="output")
        axes.set(ylabel=name, xlim=(result.times[0], result.times[-1]))
        axes.set_title(f"{name}, held out: NRMSE (std) {result.errors[name]:.3g}")
        if row == 0:
            figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2,
                          frameon=False)  # fmt: skip
    axes.set_xlabel("time [s]" if result.has_time else "row")
    wide = slice(None) if result.worth is None else 0
    _draw_spectrum(figure.add_subplot(grid[-1, wide]), result)
    if result.worth is not None:
        _draw_capacity(figure.add_subplot(grid[-1, 1]), result.worth, len(result.config.max_delays))
    return figure


def _draw_spectrum(axes: Axes, result: Result) -> None:
    axes.semilogy(1 + np.arange(len(result.spectrum)), result.spectrum, "o-", color=BLUE, ms=4)
    if result.config.resolution is not None:
        axes.axhline(result.config.resolution, color="0.5", ls=":", label="resolution")
        axes.legend(frameon=False)
    axes.set(xlabel="principal direction", ylabel="standard deviation\n[units of the signals]")
    axes.set_title(f"{len(result.signal_names)} signals of rank {result.rank}")
    count_in_whole_numbers(axes)


def _draw_capacity(axes: Axes, worth: Worth, degrees: int) -> None:
    below = np.zeros(0)
    for degree in range(1, degrees + 1):
        values = worth.capacities.by_delay(degree)
        size = max(len(values), len(below))
        values, below = (
            np.pad(values, (0, size - len(values))),
            np.pad(below, (0, size - len(below))),
        )
        colour = GROUP_COLOURS[(degree - 1) % len(GROUP_COLOURS)]
        label = f"degree {degree}: {values.sum():.1f}"
        axes.bar(range(size), values, bottom=below, color=colour, width=0.8, label=label)
        below = below + values
    axes.set(xlabel="delay of the oldest input", ylabel="capacity")
    axes.set_ylim(0.0, max(1.0, 1.05 * below.max()))
    axes.set_title(f"Capacity {below.sum():.1f}, at most {worth.capacities.rank}")
    axes.legend(frameon=False)
    count_in_whole_numbers(axes)
