"""Emulated systems: orbits, and errors over the step."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.core.integrators import INTEGRATORS
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
    """A column a target: its orbit above, the error over the step below; last, the mismatch."""
    cells = result.cells
    columns = min(COLUMNS, len(cells) + 1)
    rows = -(-(len(cells) + 1) // columns)
    figure = new_figure(3.5 * columns, 6.2 * rows)
    grid = figure.subplots(2 * rows, columns, squeeze=False)
    for place, target in enumerate(cells):
        row, column = 2 * (place // columns), place % columns
        _draw_orbit(grid[row, column], target, *result.orbits[target])
        _draw_errors(grid[row + 1, column], cells[target], result.slopes[target])
    row, column = 2 * (len(cells) // columns), len(cells) % columns
    _draw_mismatch(grid[row, column], result.mismatch_errors)
    for axes in (*grid[row + 1, column:], *grid[row, column + 1 :]):
        axes.axis("off")
    handles, labels = grid[1, 0].get_legend_handles_labels()
    names = [label.split(" ")[0] for label in labels]
    grid[row + 1, column].legend(handles, names, loc="center", frameon=False, title="lower panels")
    return figure


def _draw_orbit(axes: Axes, target: str, states: Array, wanted: Array) -> None:
    other = states.shape[1] // 2 if states.shape[1] != 3 else 2  # x1 over x1', or x over z
    axes.plot(wanted[:, 0], wanted[:, other], **TARGET_STYLE, label="target")  # fmt: skip
    axes.plot(states[:, 0], states[:, other], **OUTPUT_STYLES[0], lw=0.9, label="body")
    if states.shape[1] == 3:
        axes.set(xlabel="$x_1$ [m]", ylabel="$x_3$ [m]")
    else:
        axes.set(xlabel="$x_1 = l - l_0$ [m]", ylabel="$x_2 = dl/dt$ [m/s]")
    axes.set_title(target.replace("_", " "))
    axes.legend(frameon=False, fontsize=8)
    axes.margins(0.15)


def _draw_errors(
    axes: Axes,
    methods: Mapping[str, Mapping[float, Cell]],
    orders: Mapping[str, float | None],
) -> None:
    for name, steps in methods.items():
        colour, mark = INTEGRATOR_COLOURS[name], INTEGRATOR_MARKS[name]
        points = [(step, cell.error) for step, cell in sorted(steps.items())]
        good = np.array([p for p in points if np.isfinite(p[1])]).reshape(-1, 2)
        axes.loglog(
            *good.T, mark + "-", color=colour, ms=MARK_SIZES.get(name, 4), lw=1.2, label=name
        )
    explicit = (name for name, row in INTEGRATORS.items() if not row.implicit)
    shown = [f"{name} {orders[name]:.1f}" for name in explicit if orders.get(name)]
    axes.set_title("order: " + ", ".join(shown))
    axes.set(xlabel="step [ms]", ylabel="error / RMS radius", ylim=(1e-14, 3.0))
    axes.grid(alpha=0.25)


def _draw_mismatch(axes: Axes, mismatch: Mapping[float, float]) -> None:
    if mismatch:
        axes.loglog(list(mismatch), list(mismatch.values()), "o-", color="black", ms=4)
    axes.set(xlabel="share of p + q unknown to K", ylabel="error / RMS radius")
    axes.set_title("Van der Pol, K imprecise (RK4, 1 ms)")
    axes.grid(alpha=0.25)
