"""Walks: footfalls, pushes survived, and how the rhythm answers the ground."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.walk.config import Config
from mcmj.experiments.walk.run import Result
from mcmj.pictures.footfalls import draw_stance
from mcmj.pictures.plotting import new_figure
from mcmj.robots.walk_metrics import Walk
from mcmj.utils import files
from mcmj.utils.colours import BLUE, GREEN, ORANGE, RED
from mcmj.utils.validation import Array

COLOURS = (BLUE, GREEN, RED, ORANGE)
SHOWN = 4.0  # seconds of each walk in the figure of footfalls
STYLES: dict[str, dict[str, Any]] = {  # of stages without and with the ground in the body
    "uncoupled": {"color": "0.55", "marker": "s", "ms": 4, "ls": "--"},
    "coupled": {"color": COLOURS[0], "marker": "o", "ms": 4},
}
CAUSES = {"slope": "slope [degrees]", "load": "load [kg]"}


def figures(result: Result) -> dict[str, Figure]:
    """By file name: what the parts of the config ask for."""
    found = {}
    table: Any = files.plain(result.metrics)
    if result.walks:
        found["footfalls"] = footfalls(result.walks, table)
    if "push" in table:
        found["pushes"] = pushes(result.config, table["push"])
    if "adapt" in table:
        found["adapt"] = stride_periods(table["adapt"])
    if "recover" in table:
        found["recover"] = phase_responses(table["recover"], result.config.nudge)
    return found


def footfalls(walks: Mapping[str, Walk], table: Mapping[str, Any]) -> Figure:
    """When each foot bears load, over the last seconds of each walk.

    Args:
        table: of the part walk, by gait.
    """
    rows = -(-len(walks) // 2)
    figure = new_figure(11.0, 1.9 * rows + 0.3)
    grid = figure.subplots(rows, 2, squeeze=False).ravel()
    for axes in grid[len(walks) :]:
        axes.set_axis_off()
    for (name, walk), axes in zip(walks.items(), grid, strict=False):
        draw_stance(axes, walk.after(walk.times[-1] - SHOWN))
        period, speed = table[name]["stride_period_s"], table[name]["speed_m_s"]
        title = f"{name}: {period:.2f} s, " + (f"{speed:.2f} m/s" if speed else "falls")
        axes.set(xlim=(0, SHOWN), title=title, xlabel="time [s]")
    return figure


def pushes(config: Config, table: Mapping[str, Any]) -> Figure:
    """Share of pushes survived by impulse: a bar for each gait.

    Args:
        table: of the part push.
    """
    survived = {name: table[name]["survived"] for name in config.gaits}
    figure = new_figure(5.6, 3.8)
    axes = figure.subplots()
    impulses = list(next(iter(survived.values())))
    width = 0.8 / len(survived)
    for index, (name, counts) in enumerate(survived.items()):
        places = np.arange(len(impulses)) - 0.4 + (index + 0.5) * width
        share = [100 * count / config.seeds for count in counts.values()]
        bars = axes.bar(places, share, 0.9 * width, color=COLOURS[index], label=name)
        axes.bar_label(bars, [str(count) for count in counts.values()], fontsize=8)
    axes.set_xticks(np.arange(len(impulses)), impulses)
    axes.set(xlabel="impulse on the trunk [N s]", ylabel="pushes survived [%]", ylim=(0, 108))
    figure.legend(loc="outside upper center", ncols=len(survived), frameon=False)
    _plain(axes)
    return figure


def stride_periods(table: Mapping[str, Any]) -> Figure:
    """How the stride period of each gait answers slope and load, without coupling and with it.

    Symbols are medians over the starts, bars their range, cut off where the figure ends. Each
    panel has a scale of its own.

    Args:
        table: of the part adapt.
    """
    figure = new_figure(11.0, 5.0)
    grid = figure.subplots(2, len(table), sharex="row", squeeze=False)
    for column, (name, by_coupling) in enumerate(table.items()):
        for axes, (cause, unit) in zip(grid[:, column], CAUSES.items(), strict=True):
            largest = 0.0
            for label, style in STYLES.items():
                places, median, low, high = _changes(by_coupling[label][cause])
                errors = (median - low, high - median)
                axes.errorbar(places, median, errors, capsize=3, label=label, **style)
                largest = np.nanmax([largest, *np.abs(median)])
            axes.axhline(0, color="black", lw=0.6, zorder=0)
            limit = 1.5 * largest or 1.0
            axes.set(xlabel=unit, ylim=(-limit, limit))
            _plain(axes)
        grid[0, column].set_title(name)
    figure.supylabel("change of the stride period [%]", fontsize="medium")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2,
                  frameon=False)  # fmt: skip
    return figure


def _changes(rows: Mapping[str, Any]) -> Array:
    """Places, and median, low and high there, as changes [%] from the median at 0; NaN: fell."""
    spreads = [[row["stride_period_s"][part] for part in ("median", "low", "high")]
               for row in rows.values()]  # fmt: skip
    values = np.array(spreads, dtype=np.float64)
    changes = 100 * (values / values[list(rows).index("0"), 0] - 1)
    return np.column_stack([[float(place) for place in rows], changes]).T


def phase_responses(table: Mapping[str, Any], impulse: float) -> Figure:
    """By how much a push moves each gait's rhythm for good, and when it is back on its orbit.

    Args:
        table: of the part recover.
        impulse: of the pushes [N s].
    """
    figure = new_figure(11.0, 5.0)
    grid = figure.subplots(2, len(table), sharex=True, sharey="row", squeeze=False)
    for column, (name, rows) in enumerate(table.items()):
        moments = np.array(rows["moments"])
        pushed = [direction for direction in rows["coupled"] if direction != "wander"]
        for direction, colour in zip(pushed, COLOURS, strict=False):
            row = rows["coupled"][direction]
            for axes, key, scale in zip(grid[:, column], ("phase_shift", "recovery_s"), (100, 1),
                                        strict=True):  # fmt: skip
                values = scale * np.array(row[key], dtype=np.float64)
                axes.plot(moments, values, "o-", ms=4, lw=1, color=colour, label=direction)
        grid[0, column].axhline(0, **STYLES["uncoupled"] | {"marker": ""}, label="uncoupled")
        grid[0, column].set_title(name)
        grid[1, column].set_xlabel("moment of the push [strides]")
    grid[0, 0].set_ylabel("ahead for good [% of a stride]")
    grid[1, 0].set_ylabel("back on the orbit after [s]")
    for axes in grid.ravel():
        _plain(axes)
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4,
                  frameon=False, title=f"pushes of {impulse:g} N s")  # fmt: skip
    return figure


def _plain(axes: Axes) -> None:
    axes.spines[["right", "top"]].set_visible(False)
