"""Figures of walks: footfalls, pushes survived, and how the rhythm answers the ground."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.gaits import LEGS
from mcmj.plotting import new_figure
from mcmj.walkmetrics import Walk

COLOURS = ("#1f4fd6", "#2a9d3a", "#d62728", "#e07b00")
BAR = 0.7


def footfalls(walks: Mapping[str, Walk], titles: Mapping[str, str], *, shown: float) -> Figure:
    """When each foot bears load, over the last seconds of each walk.

    Args:
        shown: time of each walk [s].
    """
    rows = -(-len(walks) // 2)
    figure = new_figure(11.0, 1.9 * rows + 0.3)
    grid = figure.subplots(rows, 2, squeeze=False).ravel()
    for axes in grid[len(walks) :]:
        axes.set_axis_off()
    for (name, walk), axes in zip(walks.items(), grid, strict=False):
        last = walk.after(walk.times[-1] - shown)
        times = last.times - last.times[0]
        for leg in range(len(LEGS)):
            down = np.r_[False, last.contact[0, :, leg] > 0, False].astype(int)
            edges = np.flatnonzero(np.diff(down)).reshape(-1, 2)
            spans = [(times[a], times[b - 1] - times[a]) for a, b in edges]
            axes.broken_barh(spans, (len(LEGS) - 1 - leg - BAR / 2, BAR), facecolors="black", lw=0)
        axes.set_yticks(np.arange(len(LEGS))[::-1], LEGS)
        axes.set(xlim=(0, shown), title=titles[name], xlabel="time [s]")
        axes.spines[["left", "right", "top"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
    return figure


def pushes(survived: Mapping[str, Mapping[str, int]], total: int) -> Figure:
    """Share of pushes survived over their impulse, by gait."""
    figure = new_figure(5.6, 3.8)
    axes = figure.subplots()
    for (name, counts), colour in zip(survived.items(), COLOURS, strict=False):
        impulses = [float(impulse) for impulse in counts]
        share = [100 * count / total for count in counts.values()]
        axes.plot(impulses, share, "o-", color=colour, label=name)
    axes.set(xlabel="impulse on the trunk [N s]", ylabel="pushes survived [%]", ylim=(-3, 103))
    axes.legend(frameon=False)
    _plain(axes)
    return figure


def stride_periods(periods: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Figure:
    """Stride periods on every ground, without and with coupling, over the flat uncoupled one.

    Args:
        periods: by gait, then by coupling ("uncoupled", "coupled"), then by ground; NaN where
            the robot falls.
    """
    figure = new_figure(10.0, 3.6)
    row = figure.subplots(1, len(periods), sharey=True, squeeze=False)[0]
    for (name, by_coupling), axes in zip(periods.items(), row, strict=True):
        base = by_coupling["uncoupled"]["flat"]
        for offset, (label, colour) in enumerate((("uncoupled", "0.6"), ("coupled", COLOURS[0]))):
            change = [100 * (period / base - 1) for period in by_coupling[label].values()]
            places = np.arange(len(change)) + 0.4 * offset - 0.2
            axes.bar(places, change, 0.38, color=colour, label=label)
            for place in places[~np.isfinite(change)]:
                axes.annotate("falls", (place, 0), rotation=90, ha="center", va="bottom")
        axes.set_xticks(np.arange(len(change)), list(by_coupling["coupled"]), rotation=40)
        axes.axhline(0, color="black", lw=0.8)
        axes.set_title(name)
        _plain(axes)
    row[0].set_ylabel("change of the stride period [%]")
    figure.legend(*row[0].get_legend_handles_labels(), loc="outside upper center", ncols=2,
                  frameon=False)  # fmt: skip
    return figure


def _plain(axes: Axes) -> None:
    axes.spines[["right", "top"]].set_visible(False)
