"""Disturbed rhythms, in the manner of the paper's Fig. 6; and how much noise is too much."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mcmj.experiments.perturb.result import Recovery, Result
from mcmj.pictures.plotting import OUTPUT_STYLES, TARGET_STYLE, draw_orbit, new_figure
from mcmj.targets.limit_cycles import Target
from mcmj.utils.colours import BLACK, CHANGE_COLOUR, RECOVERED_COLOUR, TARGET_COLOUR

PHASE_COLOURS = (BLACK, CHANGE_COLOUR, RECOVERED_COLOUR)  # undisturbed, disturbed, free again
PHASE_NAMES = ("undisturbed", "disturbed", "free again")
NAMES = {
    "frozen_x1": "Output $x_1$ frozen",
    "frozen_x2": "Output $x_2$ frozen",
    "random_forces": "Constant random forces on all nodes",
    "length_noise": "White noise on all lengths",
}
SHOWN = 15.0  # s: the free run after the disturbance is drawn for this long at least


def figures(result: Result) -> dict[str, Figure]:
    """By file name, of each task: Fig. 6 of the first body; noise tolerance of all."""
    found, targets = {}, result.config.targets
    for task, wanted in targets.items():
        before = f"{task}_" if len(targets) > 1 else ""
        found[f"{before}perturb"] = perturb_figure(result.bodies[0][task].recoveries, wanted)
        if result.config.noise_curve:
            found[f"{before}noise_tolerance"] = tolerance_figure(result, task)
    return found


def perturb_figure(runs: Mapping[str, Recovery], target: Target) -> Figure:
    """Fig. 6: one row a perturbation; outputs over time, and the phase plane in the same colours.

    Where outputs are noisy they are drawn pale, those without noise on top.
    """
    figure = new_figure(12.0, 2.7 * len(runs) + 0.6)
    axes = figure.subplots(len(runs), 2, width_ratios=[3.0, 1.0], squeeze=False)
    for (name, run), (time_axes, plane) in zip(runs.items(), axes, strict=True):
        noisy = name == "length_noise"
        _draw_run(time_axes, plane, target, run, noisy=noisy)
        recovery = run.recovery_time
        back = f"back after {recovery:.1f} s" if np.isfinite(recovery) else "not back"
        time_axes.set_title(f"{NAMES.get(name, name)}: {back}")
        plane.set_title(f"orbit error in the end {100 * run.orbit_error:.2f} %")
    axes[-1, 0].set_xlabel("time in closed loop [s]")
    phases = zip(PHASE_COLOURS, PHASE_NAMES, strict=True)
    handles = [
        Line2D([], [], **TARGET_STYLE, label="target"),
        *(Line2D([], [], color=colour, label=name) for colour, name in phases),
        *(Line2D([], [], color="black", ls=OUTPUT_STYLES[c]["ls"], label=f"$x_{c + 1}$")
          for c in range(2)),
        Line2D([], [], color=RECOVERED_COLOUR, lw=1, ls=":", label="back from here on"),
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside upper center", ncols=7, frameon=False)
    return figure


def _draw_run(time_axes: Axes, plane: Axes, target: Target, run: Recovery, *, noisy: bool) -> None:
    times, fed, boundaries, recovery = run.times, run.outputs, run.boundaries, run.recovery_time
    outputs = run.clean if noisy else fed
    draw_orbit(plane, target)
    time_axes.set(ylabel="outputs")
    time_axes.margins(y=0.08)
    if len(times):
        _, begin, end = (float(times[row]) for row in boundaries[:3])
        time_axes.axvspan(begin, end, color=CHANGE_COLOUR, alpha=0.15, lw=0)
        if noisy:
            window = slice(boundaries[1], boundaries[2])
            time_axes.plot(times[window], fed[window], color=CHANGE_COLOUR, lw=0.3, alpha=0.25)
            plane.plot(*fed[window, :2].T, ",", color=CHANGE_COLOUR, alpha=0.15)
        for colour, first, last in zip(PHASE_COLOURS, boundaries, boundaries[1:], strict=False):
            rows = slice(first, last + 1)
            for c in range(outputs.shape[1]):
                time_axes.plot(times[rows], outputs[rows, c], color=colour, lw=1.1,
                               ls=OUTPUT_STYLES[c % 2]["ls"])  # fmt: skip
            plane.plot(*outputs[rows, :2].T, color=colour, lw=0.7)
        if np.isfinite(recovery):
            time_axes.axvline(end + recovery, color=RECOVERED_COLOUR, lw=1, ls=":")
        last_shown = end + max(SHOWN, 1.3 * recovery if np.isfinite(recovery) else 0.0)
        time_axes.set_xlim(times[0], min(times[-1], last_shown))


def tolerance_figure(result: Result, task: str) -> Figure:
    """Orbit error after some time of length noise against its amplitude, a line a body."""
    amplitudes, tolerance = result.config.noise_curve, result.config.tolerance
    errors = np.array([body[task].noise_errors for body in result.bodies])
    figure = new_figure(7.0, 4.0)
    axes = figure.add_subplot()
    capped = np.minimum(errors, 2.0)  # everything worse, blow-ups too, is drawn here
    axes.loglog(amplitudes, capped.T, ".-", color="0.7", lw=0.8, ms=4)
    axes.loglog(amplitudes, np.median(capped, axis=0), "o-", color="black", label="median")
    axes.axhline(tolerance, color=TARGET_COLOUR, ls="--", lw=1, label="recovered below")
    good = (errors < tolerance).sum(axis=0)
    for amplitude, count in zip(amplitudes, good, strict=True):
        axes.annotate(str(count), (amplitude, 1.0), (0, 3), ha="center", fontsize=8,
                      xycoords=("data", "axes fraction"), textcoords="offset points")  # fmt: skip
    axes.set(xlabel="noise on every length, standard deviation [m]", ylabel="orbit error after it")
    axes.set_title(f"bodies that recover, of {len(errors)}", pad=16)
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    return figure
