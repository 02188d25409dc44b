"""Emulated systems: orbits, and errors over the step."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.emulate.result import Cell, Result
from mcmj.pictures.plotting import INTEGRATOR_MARKS, OUTPUT_STYLES, TARGET_STYLE, new_figure
from mcmj.utils.colours import INTEGRATOR_COLOURS
from mcmj.utils.validation import Array

COLUMNS = 4
# the implicit ones lie on Euler: they are drawn inside its larger marks
MARK_SIZES = {"Euler": 8, "implicit": 5, "discrete": 3}


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"emulate": emulation_figure(result)}


def emulation_figure(result: Result) -> Figure:
    """Orbits of all targets; below, errors over the step, a curve a target, and the mismatch."""
    rows = -(-len(result.cells) // COLUMNS)
    figure = new_figure(11.0, 2.5 * rows + 3.4)
    parts: Any = figure.subfigures(2, 1, height_ratios=[2.5 * rows, 3.4])
    above, below = parts
    grid = above.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, (target, orbit) in zip(grid, result.orbits.items(), strict=False):
        _draw_orbit(axes, target, *orbit)
    for axes in grid[len(result.cells) :]:
        axes.axis("off")
    handles, labels = grid[0].get_legend_handles_labels()
    above.legend(handles, labels, loc="lower right", frameon=False)
    errors, mismatch = below.subplots(1, 2, width_ratios=[1.6, 1.0])
    _draw_errors(errors, result.cells)
    _draw_mismatch(mismatch, result.mismatch_errors)
    return figure


def _draw_orbit(axes: Axes, target: str, states: Array, wanted: Array) -> None:
    other = states.shape[1] // 2 if states.shape[1] != 3 else 2  # x1 over x1', or x over z
    axes.plot(wanted[:, 0], wanted[:, other], **TARGET_STYLE, label="target")
    axes.plot(states[:, 0], states[:, other], **OUTPUT_STYLES[0], lw=0.9, label="body")
    if states.shape[1] == 3:
        axes.set(xlabel="$x_1$ [m]", ylabel="$x_3$ [m]")
    else:
        axes.set(xlabel="elongation [m]", ylabel="its rate [m/s]")
    axes.set_title(target.replace("_", " "))
    axes.locator_params(nbins=4)
    axes.margins(0.15)


def _draw_errors(axes: Axes, cells: Mapping[str, Mapping[str, Mapping[float, Cell]]]) -> None:
    for name in dict.fromkeys(name for methods in cells.values() for name in methods):
        style = {"marker": INTEGRATOR_MARKS[name], "ms": MARK_SIZES.get(name, 4), "lw": 0.8}
        for methods in cells.values():
            points = [(step, cell.error) for step, cell in sorted(methods[name].items())]
            good = np.array([p for p in points if np.isfinite(p[1])]).reshape(-1, 2)
            (line,) = axes.loglog(*good.T, color=INTEGRATOR_COLOURS[name], **style)
        line.set_label(name)
    axes.set(
        xlabel="step [ms]", ylabel="error / RMS radius", title=f"{len(cells)} targets, a curve each"
    )
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_mismatch(axes: Axes, mismatch: Mapping[float, float]) -> None:
    if mismatch:
        axes.loglog(list(mismatch), list(mismatch.values()), "o-", color="black", ms=4)
    axes.set(xlabel="share of p + q unknown to K", ylabel="error / RMS radius")
    axes.set_title("Van der Pol, feedback K imprecise (RK4, 1 ms)")
    axes.grid(alpha=0.25)
