"""Which springs must be sensed: errors against their number."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mcmj.experiments.prune.result import Result
from mcmj.pictures.plotting import draw_network, new_figure
from mcmj.utils.colours import GROUP_COLOURS, TARGET_COLOUR

ORDERS = {
    "backward": "backward elimination",
    "forward": "forward selection",
    "random": "random order",
}


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"prune": pruning_figure(result)}


def pruning_figure(result: Result) -> Figure:
    """Closed-loop error against the number of sensed springs; the first body and its sensors."""
    figure = new_figure(11.5, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
    _draw_errors(left, result)
    _draw_sensors(right, result)
    return figure


def _draw_errors(axes: Axes, result: Result) -> None:
    counts, threshold = result.config.counts, result.config.threshold
    top = 3.0  # everything worse, blow-ups too, is drawn here
    for method, colour in zip(result.config.methods, GROUP_COLOURS, strict=False):
        table = result.errors(method)
        low, middle, high = np.quantile(np.minimum(table, top), (0.25, 0.5, 0.75), axis=0)
        axes.loglog(
            counts, middle, "o-", ms=3.5, lw=1.3, color=colour, label=ORDERS.get(method, method)
        )
        if len(table) > 1:
            axes.fill_between(counts, low, high, color=colour, alpha=0.15, lw=0)
    axes.axhline(np.median(result.full_errors), color="0.4", ls=":", lw=1.3, label="all springs")
    axes.axhline(
        threshold, color=TARGET_COLOUR, ls="--", lw=1, label=f"success below {threshold:g}"
    )
    ticks = [n for n in (2, 3, 5, 10, 20, 30, 60, 100, 200) if min(counts) <= n <= max(counts)]
    axes.set_xticks(ticks, [str(n) for n in ticks])
    axes.minorticks_off()
    n = len(result.bodies)
    name = f"orbit error (median of {n} bodies, quartiles)" if n > 1 else "orbit error"
    axes.set(xlabel="springs sensed", ylabel=name)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)


def _draw_sensors(axes: Axes, result: Result) -> None:
    """The first body, with the fewest springs that suffice in black."""
    method, first = result.config.methods[0], result.bodies[0]
    sensed = first.orders[method][: result.needed(method, 0) or 0]
    draw_network(axes, first.body)
    lines = first.body.positions[first.body.springs[sensed], :2]
    axes.add_collection(LineCollection(list(lines), colors="black", linewidths=2.2, zorder=1))
    axes.set_title(f"{len(lines)} of {first.body.n_springs} springs (black) suffice")
