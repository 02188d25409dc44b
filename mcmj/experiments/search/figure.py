"""Searches: success rates by setting, scores, the best bodies."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from mcmj.experiments.search.result import Result, setting_label
from mcmj.mjcf.read import from_mjcf
from mcmj.pictures.plotting import TITLES, count_in_whole_numbers, draw_network, new_figure
from mcmj.search.experiment import Score
from mcmj.utils.colours import GROUP_COLOURS, TARGET_COLOUR
from mcmj.utils.validation import Array

_LOG_FROM = 30.0  # largest over smallest value from which an axis is logarithmic


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    found = {"scores": score_figure(result)}
    if result.by_setting:
        found["success_rate"] = success_rate_figure(result.by_setting)
    if result.bodies:
        found["best_bodies"] = best_bodies_figure(result)
    return found


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


def score_figure(result: Result) -> Figure:
    """Cumulative distributions of scores; see `draw_scores`."""
    figure = new_figure(6.6, 4.2)
    draw_scores(figure.add_subplot(), _groups(result), result.config.target)
    return figure


def _groups(result: Result) -> dict[str, Array]:
    """Scores by what tells most: the settings if they are few, else the parts of the score."""
    if 1 < len(result.settings) <= 6:
        return {setting_label(s): x for s, x in zip(result.settings, result.scores, strict=True)}
    if len(result.parts) > 1:
        parts = {result.config.target.label(path): x.ravel() for path, x in result.parts.items()}
        return {**parts, "the worst of them": result.scores.ravel()}
    return {"all trials": result.scores.ravel()}


def draw_scores(axes: Axes, groups: Mapping[str, Array], target: Score) -> None:
    """Cumulative distributions of scores, one curve a group; blow-ups never come in.

    Args:
        groups: scores by label; infinite where a body blew up.
        target: the score, and from where on it is a success.
    """
    threshold, maximise = target.threshold, target.maximise
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
    axes.set(xlabel=target.name, ylabel="share of the bodies with less", ylim=(0, 1.02))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, frameon=False)
    axes.grid(alpha=0.3)


def _use_log_axis(axes: Axes, ratio: float) -> None:
    """As many numbers at a logarithmic axis from x to ratio x as there is room for."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ratio < 100.0 else (1.0,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def best_bodies_figure(result: Result) -> Figure:
    """The best bodies side by side, best first, each with its title."""
    figure = new_figure(4.8 * len(result.bodies), 5.0)
    panels = figure.subplots(1, len(result.bodies), squeeze=False)[0]
    for axes, xml, index in zip(panels, result.bodies, result.ranking, strict=False):
        body, _ = from_mjcf(xml)
        draw_network(axes, body)
        title = result.title(int(index))
        axes.set_title(f"{title}\n{body.n_nodes} nodes, {body.n_springs} springs")
    return figure


def _colours(count: int) -> list[Any]:
    if count <= len(GROUP_COLOURS):
        return list(GROUP_COLOURS[:count])

    return list(mpl.colormaps["viridis"](np.linspace(0.0, 0.9, count)))
