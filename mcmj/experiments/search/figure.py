"""Figures of searches and of pruned readouts. Takes results, never simulates."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from mcmj.core.body import Body
from mcmj.pictures.plotting import TITLES, count_in_whole_numbers, draw_body, new_figure
from mcmj.utils.colours import GROUP_COLOURS, TARGET_COLOUR
from mcmj.utils.validation import Array

_ORDERS = {
    "backward": "backward elimination",
    "forward": "forward selection",
    "random": "random order",
}
_LOG_FROM = 30.0  # largest over smallest value from which an axis is logarithmic


def success_rate_figure(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> Figure:
    """Success rate with its 95 % interval against each varied field, one panel each.

    Args:
        tables: by path, rows with value, successes, of, interval_95, as from
            mcmj.search.summary.success_by_setting.
    """
    columns = min(3, len(tables))
    rows = -(-len(tables) // columns)
    figure = new_figure(4.4 * columns, 3.4 * rows)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (path, table) in zip(grid, tables.items(), strict=False):
        _draw_rates(axes, table)
        axes.set(xlabel=path, ylim=(-0.03, 1.03))
        axes.grid(alpha=0.3)
    for axes in grid[len(tables) :]:
        axes.set_axis_off()
    for axes in grid[::columns]:
        axes.set_ylabel("success rate")
    return figure


def _draw_rates(axes: Axes, table: Sequence[Mapping[str, Any]]) -> None:
    rates = np.array([row["successes"] / row["of"] for row in table])
    intervals = np.array([row["interval_95"] for row in table]).T
    spans = np.abs(intervals - rates)
    values = [row["value"] for row in table]
    numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    places = np.array(values if numeric else range(len(values)), dtype=float)
    style: dict[str, Any] = {"color": "black", "capsize": 3, "ms": 4, "lw": 1}
    if numeric and "low" in table[0]:
        ends = np.array([[row["low"], row["high"]] for row in table]).T
        style["xerr"] = np.abs(ends - places)
    axes.errorbar(places, rates, yerr=spans, fmt="o-" if numeric else "o", **style)
    if not numeric:
        labels = [v if isinstance(v, str) else json.dumps(v) for v in values]
        axes.set_xticks(places, labels, rotation=20 if max(map(len, labels)) > 8 else 0)
        axes.set_xlim(-0.5, len(values) - 0.5)
        return
    if places.min() > 0 and places.max() > _LOG_FROM * places.min():
        axes.set_xscale("log")
    if "low" not in table[0] and len(places) <= 8:
        axes.set_xticks(places, [f"{place:.3g}" for place in places])
        axes.minorticks_off()
    elif axes.get_xscale() == "linear" and all(isinstance(v, int) for v in values):
        count_in_whole_numbers(axes)


def score_figure(
    groups: Mapping[str, Array], threshold: float, *, name: str, maximise: bool = False
) -> Figure:
    """Cumulative distributions of scores; see `draw_scores`."""
    figure = new_figure(6.6, 4.2)
    draw_scores(figure.add_subplot(), groups, threshold, name=name, maximise=maximise)
    return figure


def draw_scores(
    axes: Axes, groups: Mapping[str, Array], threshold: float, *, name: str, maximise: bool = False
) -> None:
    """Cumulative distributions of scores, one curve a group; blow-ups never come in.

    Args:
        groups: scores by label; infinite where a body blew up.
        threshold: of a success.
        name: of the score.
    """
    for (label, scores), colour in zip(groups.items(), _colours(len(groups)), strict=True):
        finite = np.sort(scores[np.isfinite(scores)])
        good = int(((scores > threshold) if maximise else (scores < threshold)).sum())
        share = np.arange(1, len(finite) + 1) / len(scores)
        text = f"{TITLES.get(label, label)}: {good} of {len(scores)}"
        axes.step(finite, share, where="post", color=colour, lw=1.4, label=text)
    finite = np.concatenate([scores[np.isfinite(scores)] for scores in groups.values()])
    if finite.size and finite.min() > 0 and finite.max() > _LOG_FROM * finite.min():
        _use_log_axis(axes, finite.max() / finite.min())
    side = "above" if maximise else "below"
    axes.axvline(
        threshold, color=TARGET_COLOUR, ls="--", lw=1, label=f"success {side} {threshold:g}"
    )
    axes.set(xlabel=name, ylabel="share of the bodies with less", ylim=(0, 1.02))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, frameon=False)
    axes.grid(alpha=0.3)


def _use_log_axis(axes: Axes, ratio: float) -> None:
    """As many numbers at a logarithmic axis from x to ratio x as there is room for."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ratio < 100.0 else (1.0,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def best_bodies_figure(bodies: Sequence[tuple[Body, str]]) -> Figure:
    """The best bodies side by side, best first, each with its title."""
    figure = new_figure(4.8 * len(bodies), 5.0)
    for axes, (body, title) in zip(
        np.atleast_1d(figure.subplots(1, len(bodies))), bodies, strict=True
    ):
        draw_body(axes, body)
        axes.set_title(f"{title}\n{body.n_nodes} nodes, {body.n_springs} springs")
    return figure


def _colours(count: int) -> list[Any]:
    if count <= len(GROUP_COLOURS):
        return list(GROUP_COLOURS[:count])

    return list(mpl.colormaps["viridis"](np.linspace(0.0, 0.9, count)))


def pruning_figure(
    counts: Sequence[int],
    errors: Mapping[str, Array],
    full_errors: Array,
    threshold: float,
    *,
    body: Body,
    sensed: npt.NDArray[np.int64],
) -> Figure:
    """Closed-loop error against the number of sensed springs; the first body and its sensors.

    Args:
        counts: (K,) numbers of springs.
        errors: (bodies, K) orbit errors by method.
        full_errors: (bodies,) with all springs.
        threshold: of a success.
        body: drawn, with the springs `sensed` in black.
    """
    figure = new_figure(11.5, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
    top = 3.0  # everything worse, blow-ups too, is drawn here
    for (method, table), colour in zip(errors.items(), GROUP_COLOURS, strict=False):
        low, middle, high = np.quantile(np.minimum(table, top), (0.25, 0.5, 0.75), axis=0)
        left.loglog(
            counts, middle, "o-", ms=3.5, lw=1.3, color=colour, label=_ORDERS.get(method, method)
        )
        if len(table) > 1:
            left.fill_between(counts, low, high, color=colour, alpha=0.15, lw=0)
    left.axhline(np.median(full_errors), color="0.4", ls=":", lw=1.3, label="all springs")
    left.axhline(
        threshold, color=TARGET_COLOUR, ls="--", lw=1, label=f"success below {threshold:g}"
    )
    ticks = [n for n in (2, 3, 5, 10, 20, 30, 60, 100, 200) if min(counts) <= n <= max(counts)]
    left.set_xticks(ticks, [str(n) for n in ticks])
    left.minorticks_off()
    several = len(full_errors) > 1
    name = (
        f"orbit error (median of {len(full_errors)} bodies, quartiles)"
        if several
        else "orbit error"
    )
    left.set(xlabel="springs sensed", ylabel=name)
    left.grid(alpha=0.3)
    left.legend(frameon=False)
    draw_body(right, body)
    lines = body.positions[body.springs[sensed]]
    right.add_collection(LineCollection(list(lines), colors="black", linewidths=2.2, zorder=1))
    right.set_title(f"{len(lines)} of {body.n_springs} springs (black) suffice")
    return figure


def guided_figure(
    objectives: Sequence[float],
    judged: Mapping[str, Array],
    threshold: float,
    *,
    names: tuple[str, str],
    maximise: tuple[bool, bool] = (False, False),
) -> Figure:
    """The objective of every setting tried and the best so far; scores on other bodies.

    Args:
        objectives: in the order of the trials.
        judged: scores (bodies,) by label.
        threshold: of a success.
        names, maximise: of the objective, and of the score.
    """
    figure = new_figure(11.0, 4.0)
    left, right = figure.subplots(1, 2)
    values = np.array(objectives)
    number = np.arange(1, len(values) + 1)
    so_far = (np.maximum if maximise[0] else np.minimum).accumulate(values)
    left.plot(number, values, ".", color="0.5", label="a setting")
    left.step(number, so_far, where="post", color="black", lw=1.4, label="best so far")
    count_in_whole_numbers(left)
    left.set(xlabel="settings tried", ylabel=f"objective ({names[0]})")
    left.grid(alpha=0.3)
    left.legend(frameon=False)
    draw_scores(right, judged, threshold, name=names[1], maximise=maximise[1])
    right.set_title("on bodies that the search has not seen")
    return figure
