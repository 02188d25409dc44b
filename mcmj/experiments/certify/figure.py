"""The report card of `mcmj.experiments.certify.run` as a figure. Takes arrays, never simulates."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.pictures.plotting import TITLES, draw_orbit, draw_phase_plane, new_figure
from mcmj.targets.limit_cycles import Target
from mcmj.utils.colours import BLUE, ORANGE, TARGET_COLOUR
from mcmj.utils.validation import Array

Complex = npt.NDArray[np.complex128]


def certificate_figure(
    target: Target,
    outputs: Array,
    *,
    multipliers: Complex,
    target_multipliers: Complex | None,
    starts: tuple[Array, Array],
    blows: Sequence[tuple[str, Array, Array, Array]],
    tolerances: Sequence[tuple[str, Array, float, tuple[float, float]]],
    lines: Sequence[tuple[str, str]],
) -> Figure:
    """One page.

    Args:
        outputs: (T, n) of the end of the free run.
        multipliers, target_multipliers: complex, of the body and of its target's system.
        starts: first outputs (B, n), and recovery times (B,) [s], infinite if lost.
        blows: per kind: axis label, strengths (K,), recovered and overflowed fractions (K,).
        tolerances: per kind: label, largest amplitudes (B,) that copies recover from, their
            median and its interval.
        lines: names and values of the text panel.
    """
    figure = new_figure(15.0, 8.6)
    grid = figure.add_gridspec(2, 4, width_ratios=[1, 1, 1, 1.15])
    axes = [figure.add_subplot(grid[row, column]) for row in range(2) for column in range(3)]
    draw_phase_plane(axes[0], outputs, target)
    axes[0].set_title("free run, red: target")
    _draw_multipliers(axes[1], multipliers, target_multipliers)
    _draw_starts(figure, axes[2], target, *starts)
    for ax, (label, strengths, good, blown) in zip(axes[3:5], blows, strict=True):
        _draw_blows(ax, label, strengths, good, blown)
    _draw_tolerances(axes[5], tolerances)
    _draw_lines(figure.add_subplot(grid[:, 3]), lines)
    figure.suptitle(f"Certificate: {TITLES.get(target.name, target.name)}")
    return figure


def _draw_multipliers(axes: Axes, body: Complex, target: Complex | None) -> None:
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 200))
    axes.plot(circle.real, circle.imag, color="0.6", lw=1)
    axes.plot(body.real, body.imag, "o", ms=5, color=BLUE, mec="black", mew=0.4, label="body")
    if target is not None:
        axes.plot(
            target.real, target.imag, "x", ms=9, mew=2, color=TARGET_COLOUR, label="target's system"
        )
    axes.set(aspect="equal", xlabel="real part", ylabel="imaginary part")
    axes.set_title(f"Floquet multipliers\nleading nontrivial {abs(body[1]):.4f}")
    axes.legend(loc="center", bbox_to_anchor=(0.5, 0.28))


def _draw_starts(figure: Figure, axes: Axes, target: Target, first: Array, times: Array) -> None:
    draw_orbit(axes, target)
    good, known = np.isfinite(times), np.isfinite(first).all(axis=1)
    points = axes.scatter(
        first[good, 0], first[good, 1], c=times[good], s=16, cmap="viridis", zorder=3
    )
    figure.colorbar(points, ax=axes, label="recovery time [s]", shrink=0.75)
    axes.plot(*first[~good & known, :2].T, "x", color="black", ms=5, zorder=4)
    axes.set(xlabel="first $x_1$", ylabel="first $x_2$")
    axes.set_title(
        f"started by scaled teachers:\n{int(good.sum())} of {len(good)} come to the orbit"
    )


def _draw_blows(axes: Axes, label: str, strengths: Array, good: Array, blown: Array) -> None:
    axes.semilogx(strengths, good, "o-", color=BLUE, label="recovered")
    axes.semilogx(strengths, blown, "s--", color=ORANGE, ms=4, label="overflowed")
    axes.set(xlabel=label, ylabel="fraction", ylim=(-0.05, 1.05))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)


def _draw_tolerances(
    axes: Axes, tolerances: Sequence[tuple[str, Array, float, tuple[float, float]]]
) -> None:
    axes.set_xscale("log")
    for row, (label, values, median, (low, high)) in enumerate(tolerances):
        line = axes.ecdf(values, complementary=True, label=label)
        if np.isfinite(high):
            bar, y = [[median - low], [high - median]], 0.5 + 0.04 * (row - 1)
            axes.errorbar(median, y, xerr=bar, fmt="o", ms=4, capsize=3, color=line.get_color())
    axes.set(xlabel="amplitude for 10 s", ylabel="fraction that recovers")
    axes.set(yticks=np.linspace(0, 1, 6), ylim=(-0.4, 1.05))  # room for the legend
    axes.set_title("tolerances; medians with 95 % intervals")
    axes.legend(fontsize=8, loc="lower left")
    axes.grid(alpha=0.3)


def _draw_lines(axes: Axes, lines: Sequence[tuple[str, str]]) -> None:
    axes.axis("off")
    for row, (name, value) in enumerate(lines):
        y = 0.98 - row * 0.96 / max(len(lines), 1)
        axes.text(0.0, y, name, transform=axes.transAxes, va="top", fontsize=9)
        axes.text(1.0, y, value, transform=axes.transAxes, va="top", ha="right", fontsize=9)
