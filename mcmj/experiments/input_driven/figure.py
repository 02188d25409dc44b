"""Rhythms chosen by an input, in the manner of the paper's Figs. 10 and 11."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mcmj.experiments.input_driven.config import Config
from mcmj.experiments.input_driven.result import BodyResult, Held, Result
from mcmj.pictures.plotting import (
    OUTPUT_STYLES,
    TARGET_STYLE,
    best_phase,
    draw_outputs,
    draw_phase_plane,
    new_figure,
    output_handles,
)
from mcmj.utils.colours import BLUE, ORANGE
from mcmj.utils.validation import Array

SHOWN = 40.0  # s: length of the two parts of a run that are drawn
WAYS = (("v", BLUE, "body, sweep down"), ("^", ORANGE, "body, sweep up"))


def figures(result: Result) -> dict[str, Figure]:
    """By file name: Figs. 10 and 11 of the first body."""
    return {
        "input_curves": input_curves_figure(result.first),
        "input_jumps": jumps_figure(result.first, result.config),
    }


def input_curves_figure(body: BodyResult) -> Figure:
    """Fig. 10: amplitude and frequency of the first output against the input."""
    figure = new_figure(11.0, 4.2)
    inputs, runs = list(body.held), list(body.held.values())
    branches = body.sweep.body if body.sweep else ()
    labels = {"amplitude": "amplitude of $x_1$", "frequency": "frequency of $x_1$ [Hz]"}
    for axes, (quantity, label) in zip(figure.subplots(1, 2), labels.items(), strict=True):
        wanted = np.array([run.metrics[f"target_{quantity}"] for run in runs])
        axes.axvspan(*body.start.taught, color="0.93", lw=0, zorder=0)
        axes.semilogx(inputs, wanted, **TARGET_STYLE)
        for branch, (mark, colour, _) in zip(branches, WAYS, strict=False):
            values = branch.amplitudes if quantity == "amplitude" else branch.frequencies
            axes.semilogx(branch.inputs, values, mark, color=colour, ms=3.5, alpha=0.7, mew=0)
        found = [run.metrics[quantity] for run in runs]
        axes.semilogx(inputs, found, "o", color="black", ms=6, mfc="white", mew=1.3)
        marks = [u for u in (0.1, 0.2, 0.5, 1, 2, 5, 10) if inputs[0] <= u <= inputs[-1]]
        axes.set_xticks(marks, [f"{u:g}" for u in marks])
        axes.minorticks_off()
        axes.set(xlabel="input $\\epsilon$", ylabel=label, ylim=_limits(wanted))
        axes.grid(alpha=0.3)
    handles = [
        Line2D([], [], **TARGET_STYLE, label="target"),
        Line2D([], [], color="black", ls="", marker="o", ms=6, mfc="white", mew=1.3,
               label="body, constant input"),
    ]  # fmt: skip
    handles += [
        Line2D([], [], color=colour, ls="", marker=mark, ms=5, mew=0, label=name)
        for mark, colour, name in WAYS[: len(branches)]
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    return figure


def jumps_figure(body: BodyResult, config: Config) -> Figure:
    """Fig. 11: after the jump to each input, the last part on its target, and the phase plane."""
    inputs, last_input = config.inputs, config.course.last
    figure = new_figure(14.0, 2.8 * len(inputs) + 0.5)
    axes = figure.subplots(len(inputs), 3, width_ratios=[1.7, 1.7, 1.0], squeeze=False)
    for value, row in zip(inputs, axes, strict=True):
        held = body.held[value]
        jump = f"jumps from {last_input:g} to {value:g} at 0 s"
        row[0].set_title(f"input stays at {value:g}" if value == last_input else f"input {jump}")
        row[2].set_title(f"orbit error {100 * held.orbit_error:.2f} %")
        if len(held.outputs):
            _draw_run(row, held, config.timestep)
        for ax, name in zip(row[:2], ("outputs", ""), strict=True):
            ax.set(ylabel=name, xlabel="")
    for ax in axes[-1, :2]:
        ax.set_xlabel("time since the jump [s]")
    figure.legend(handles=output_handles(2), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _draw_run(row: Sequence[Axes], held: Held, timestep: float) -> None:
    target, outputs = held.target, held.outputs
    times = timestep * np.arange(len(outputs), dtype=np.float64)
    rows = min(round(SHOWN / timestep), len(outputs))
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
