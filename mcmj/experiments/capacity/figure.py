"""What a body is worth: capacity by delay, and maps over settings."""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.capacity.result import Result
from mcmj.pictures.plotting import new_figure
from mcmj.utils.colours import GROUP_COLOURS
from mcmj.utils.validation import Array

NAMES = {
    "memory_capacity": "Linear memory capacity",
    "ipc_total": "Information processing capacity",
    "kernel_rank": "Kernel rank",
    "generalisation_rank": "Generalisation rank",
}


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"capacity": capacity_figure(result)}


def capacity_figure(result: Result) -> Figure:
    """The body's capacities over the delay; below, a row of measures for each map."""
    config, maps = result.config, result.maps
    sides = {
        "stiffness_damping": ("stiffness factor", config.stiffness, "damping factor",
                              config.damping),
        "size_strength": ("nodes", config.sizes, "input strength [N]", config.strengths),
    }  # fmt: skip
    figure = new_figure(15.5, 3.2 + 3.6 * len(maps))
    grid = figure.add_gridspec(1 + len(maps), len(NAMES))
    _draw_delays(figure.add_subplot(grid[0, :]), result.by_delay)
    for row, (map_name, measures) in enumerate(maps.items(), start=1):
        y_label, ys, x_label, xs = sides[map_name]
        for column, (name, title) in enumerate(NAMES.items()):
            axes = figure.add_subplot(grid[row, column])
            _draw_map(axes, measures[name])
            axes.set_xticks(range(len(xs)), [f"{x:g}" for x in xs])
            axes.set_yticks(range(len(ys)), [f"{y:g}" for y in ys])
            axes.set(xlabel=x_label, ylabel=y_label, title=title)
    return figure


def _draw_delays(axes: Axes, by_delay: Mapping[int, Array]) -> None:
    longest = max(len(values) for values in by_delay.values())
    below = np.zeros(longest)
    for (degree, values), colour in zip(by_delay.items(), GROUP_COLOURS, strict=False):
        padded = np.pad(values, (0, longest - len(values)))
        label = f"degree {degree}: {padded.sum():.1f}"
        axes.bar(range(longest), padded, bottom=below, color=colour, width=0.8, label=label)
        below += padded
    last = int(np.flatnonzero(below)[-1]) if below.any() else 0
    axes.set(xlabel="delay of the oldest input [symbols]", ylabel="capacity",
             xlim=(-0.7, last + 0.7))  # fmt: skip
    axes.set_title(f"Capacity in MuJoCo, {below.sum():.1f} in all")
    axes.legend(frameon=False)


def _draw_map(axes: Axes, values: Array) -> None:
    colours = mpl.colormaps["viridis"].with_extremes(bad="0.8")
    image = axes.imshow(np.ma.masked_invalid(values), origin="lower", cmap=colours, vmin=0)
    middle = 0.6 * np.nanmax(values)
    for (row, column), value in np.ndenumerate(values):
        text = f"{value:.0f}" if np.isfinite(value) else "blew\nup"
        dark = not np.isfinite(value) or value > middle
        axes.annotate(text, (column, row), ha="center", va="center", fontsize=8,
                      color="black" if dark else "white")  # fmt: skip
    axes.figure.colorbar(image, ax=axes, shrink=0.85)
