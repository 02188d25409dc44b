"""Swinging up from rest, in the manner of the paper's Fig. 7."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mcmj.experiments.swing_up.result import Result, SwingUp
from mcmj.pictures.plotting import OUTPUT_STYLES, TITLES, draw_orbit, new_figure, output_handles
from mcmj.utils.colours import CHANGE_COLOUR


def figures(result: Result) -> dict[str, Figure]:
    """By file name: Fig. 7 of the first body."""
    return {"swing_up": swing_up_figure(result.bodies[0])}


def swing_up_figure(tasks: Mapping[str, SwingUp]) -> Figure:
    """Fig. 7: from rest onto the orbit; outputs over time and the phase plane, a row a task."""
    figure = new_figure(12.0, 2.7 * len(tasks) + 0.5)
    axes = figure.subplots(len(tasks), 2, width_ratios=[3.0, 1.0], squeeze=False)
    for (name, task), (time_axes, plane) in zip(tasks.items(), axes, strict=True):
        outputs, swing_up = task.outputs, task.swing_up_time
        times = task.timestep * np.arange(len(outputs))
        draw_orbit(plane, task.target)
        arrived = np.isfinite(swing_up)
        end = max(20.0, 1.5 * swing_up) if arrived else np.inf
        rows = times <= end
        for c in range(outputs.shape[1]):
            time_axes.plot(times[rows], outputs[rows, c], lw=1.2, **OUTPUT_STYLES[c % 2])
        plane.plot(*outputs[rows, :2].T, color="black", lw=0.8)
        if len(times):
            plane.plot(*outputs[0, :2], "o", color=CHANGE_COLOUR, ms=6)
        if arrived:
            time_axes.axvline(swing_up, color=CHANGE_COLOUR, lw=1.2, ls=":")
        when = f"on the orbit after {swing_up:.1f} s" if arrived else "does not arrive"
        time_axes.set_title(f"{TITLES.get(name, name)}, from total rest: {when}")
        time_axes.set(ylabel="outputs")
        time_axes.margins(x=0)
        time_axes.locator_params(axis="x", nbins=8)
        plane.set_title(f"orbit error in the end {100 * task.orbit_error:.2f} %")
    axes[-1, 0].set_xlabel("time in closed loop [s]")
    handles = [
        *output_handles(2),
        Line2D([], [], color=CHANGE_COLOUR, marker="o", ls="", label="at rest"),
        Line2D([], [], color=CHANGE_COLOUR, lw=1.2, ls=":", label="on the orbit from here on"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False)
    return figure
