"""Figures of rhythms chosen by an input, in the manner of the paper's Figs. 10 and 11."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mcmj.pictures.plotting import (
    OUTPUT_STYLES,
    TARGET_STYLE,
    best_phase,
    draw_outputs,
    draw_phase_plane,
    new_figure,
    output_handles,
)
from mcmj.targets.limit_cycles import Target
from mcmj.utils.colours import BLUE, ORANGE
from mcmj.utils.validation import Array

Curve = tuple[Array, Array, Array]  # inputs, amplitudes, frequencies [Hz]


def input_curves_figure(
    target: Curve, held: Curve, sweep: Sequence[Curve], taught: tuple[float, float]
) -> Figure:
    """Fig. 10: amplitude and frequency of the first output against the input.

    Args:
        target: of the limit cycles at constant inputs, by increasing input.
        held: of the body at constant inputs, NaN where it has no rhythm.
        sweep: of the body on the slow way down and up again; may be empty.
        taught: range of the inputs it was taught with.
    """
    figure = new_figure(11.0, 4.2)
    labels = ("amplitude of $x_1$", "frequency of $x_1$ [Hz]")
    for quantity, (axes, label) in enumerate(zip(figure.subplots(1, 2), labels, strict=True), 1):
        axes.axvspan(*taught, color="0.93", lw=0, zorder=0)
        axes.semilogx(target[0], target[quantity], **TARGET_STYLE)
        for branch, colour, mark in zip(sweep, (BLUE, ORANGE), "v^", strict=False):
            axes.semilogx(branch[0], branch[quantity], mark, color=colour, ms=3.5, alpha=0.7, mew=0)
        axes.semilogx(held[0], held[quantity], "o", color="black", ms=6, mfc="white", mew=1.3)
        marks = [u for u in (0.1, 0.2, 0.5, 1, 2, 5, 10) if held[0][0] <= u <= held[0][-1]]
        axes.set_xticks(marks, [f"{u:g}" for u in marks])
        axes.minorticks_off()
        axes.set(xlabel="input $\\epsilon$", ylabel=label, ylim=_limits(target[quantity]))
        axes.grid(alpha=0.3)
    handles = [
        Line2D([], [], **TARGET_STYLE, label="target"),
        Line2D([], [], color="black", ls="", marker="o", ms=6, mfc="white", mew=1.3,
               label="body, constant input"),
    ]  # fmt: skip
    ways = (("v", BLUE, "body, sweep down"), ("^", ORANGE, "body, sweep up"))
    handles += [
        Line2D([], [], color=colour, ls="", marker=mark, ms=5, mew=0, label=name)
        for mark, colour, name in ways[: len(sweep)]
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    return figure


def jumps_figure(
    runs: Mapping[float, tuple[Target, Array, float]], timestep: float, last_input: float,
    *, shown: float = 40.0,
) -> Figure:  # fmt: skip
    """Fig. 11: after the jump to each input, the last part on its target, and the phase plane.

    Args:
        runs: by input: target, outputs (T, n) from the jump on, orbit error.
        timestep: [s].
        last_input: the input before the jump.
        shown: length of the two parts [s].
    """
    figure = new_figure(14.0, 2.8 * len(runs) + 0.5)
    axes = figure.subplots(len(runs), 3, width_ratios=[1.7, 1.7, 1.0], squeeze=False)
    for (value, (target, outputs, error)), row in zip(runs.items(), axes, strict=True):
        jump = f"jumps from {last_input:g} to {value:g} at 0 s"
        row[0].set_title(f"input stays at {value:g}" if value == last_input else f"input {jump}")
        row[2].set_title(f"orbit error {100 * error:.2f} %")
        if len(outputs):
            _draw_run(row, target, outputs, timestep, shown)
        for ax, name in zip(row[:2], ("outputs", ""), strict=True):
            ax.set(ylabel=name, xlabel="")
    for ax in axes[-1, :2]:
        ax.set_xlabel("time since the jump [s]")
    figure.legend(handles=output_handles(2), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _draw_run(
    row: Sequence[Axes], target: Target, outputs: Array, timestep: float, shown: float
) -> None:
    times = timestep * np.arange(len(outputs), dtype=np.float64)
    rows = min(round(shown / timestep), len(outputs))
    for c in range(2):
        row[0].plot(times[:rows], outputs[:rows, c], lw=1.2, **OUTPUT_STYLES[c])
    row[0].margins(x=0)
    shift = best_phase(outputs[-rows:], target, times[-rows:])
    draw_outputs(row[1], times[-rows:], outputs[-rows:], target.sample(times[-rows:] + shift))
    row[1].set_title(f"last {rows * timestep:g} s (target moved by {shift:+.2f} s)")
    draw_phase_plane(row[2], outputs[-rows:], target)


def _limits(values: Array) -> tuple[float, float]:
    """A body far off must not squeeze the curve."""
    margin = 0.25 * float(np.ptp(values))
    return float(values.min()) - margin, float(values.max()) + margin
