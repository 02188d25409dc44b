"""Figures of scripts/emulate.py and scripts/linearise.py. Takes results, never simulates."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.core.integrators import INTEGRATORS
from mcmj.pictures.plotting import INTEGRATOR_MARKS, OUTPUT_STYLES, TARGET_STYLE, new_figure
from mcmj.utils.colours import (
    BROWN,
    GROUP_COLOURS,
    INTEGRATOR_COLOURS,
    LILAC,
    PINK,
    TARGET_COLOUR,
)
from mcmj.utils.validation import Array

COLUMNS = 4
# the implicit ones lie on Euler: they are drawn inside its larger marks
MARK_SIZES = {"Euler": 8, "implicit": 5, "discrete": 3}


class HasError(Protocol):
    """One target, integrator and step."""

    @property
    def error(self) -> float:
        """Relative error."""


def emulation_figure(
    orbits: Mapping[str, tuple[Array, Array]],
    cells: Mapping[str, Mapping[str, Mapping[float, HasError]]],
    orders: Mapping[str, Mapping[str, float | None]],
    mismatch: Mapping[float, float],
) -> Figure:
    """A column a target: its orbit above, the error over the step below; last, the mismatch.

    Args:
        orbits: [target] states (T, n) of the body and of the target.
        cells: [target][integrator][step_ms].
        orders: [target][integrator] observed order, None if unknown.
        mismatch: Van der Pol's error by the share of p and q that K does not know.
    """
    columns = min(COLUMNS, len(cells) + 1)
    rows = -(-(len(cells) + 1) // columns)
    figure = new_figure(3.5 * columns, 6.2 * rows)
    grid = figure.subplots(2 * rows, columns, squeeze=False)
    for place, target in enumerate(cells):
        row, column = 2 * (place // columns), place % columns
        _draw_orbit(grid[row, column], target, *orbits[target])
        _draw_errors(grid[row + 1, column], cells[target], orders[target])
    row, column = 2 * (len(cells) // columns), len(cells) % columns
    _draw_mismatch(grid[row, column], mismatch)
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
    methods: Mapping[str, Mapping[float, HasError]],
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


def diversity_figure(
    diversities: Sequence[float],
    conditions: Mapping[int, Sequence[float]],
    ranks: Mapping[int, Sequence[int]],
    errors: Mapping[int, Sequence[float]],
    equal: Mapping[int, float],
) -> Figure:
    """Conditioning and rank of R, and errors of the filter, as the diversity goes to 0.

    Args:
        diversities: positive ones, descending or ascending.
        conditions, ranks: [masses] at each of them, the ranks over 2 n.
        errors: [masses] nrmse_std of the filter at each of them.
        equal: [masses] the same without diversity.
    """
    figure = new_figure(13.5, 4.0)
    left, middle, right = figure.subplots(1, 3)
    palette = [*GROUP_COLOURS, LILAC, BROWN, PINK, "0.5"]
    colours = dict(zip(sorted({*conditions, *errors}), itertools.cycle(palette)))
    for n, values in conditions.items():
        colour = colours[n]
        left.loglog(diversities, values, "o-", color=colour, ms=4, label=f"{n} springs")
        middle.semilogx(diversities, np.divide(ranks[n], 2 * n), "o-", color=colour, ms=4,
                        label=f"{n} springs")  # fmt: skip
    left.axhline(1 / np.finfo(float).eps, color="0.6", ls="--", lw=1)
    left.annotate("1 / rounding error", (min(diversities), 2e15), color="0.4", fontsize=8,
                  va="top")  # fmt: skip
    left.set(ylabel="condition number of R", ylim=(1, 1e22))
    middle.set(ylabel="numerical rank of R / 2n", ylim=(0, 1.08))
    middle.legend(frameon=False, loc="lower right")
    for n, values in errors.items():
        right.loglog(diversities, values, "o-", color=colours[n], ms=4, label=f"{n} springs")
    right.axhline(max(equal.values()), color=TARGET_COLOUR, ls="--", lw=1, label="equal springs")
    right.set(ylabel="NRMSE (std) on held-out data")
    right.legend(frameon=False, loc="lower left")
    left.set_title("Controllability of the array")
    middle.set_title("2n states are reachable only with diversity")
    right.set_title("The array as a fading memory")
    for axes in (left, middle, right):
        axes.set_xlabel("diversity: stiffness x exp($\\pm$diversity)")
        axes.grid(alpha=0.3)
    return figure
