"""Learned limit cycles, in the manner of the paper's Fig. 5; the errors of many bodies."""

import numpy as np
from matplotlib.figure import Figure

from mcmj.experiments.limit_cycle.result import Result
from mcmj.experiments.limit_cycle.seeds import SuccessOfSeeds
from mcmj.pictures.plotting import (
    TITLES,
    best_phase,
    count_in_whole_numbers,
    draw_network,
    draw_outputs,
    draw_phase_plane,
    new_figure,
    output_handles,
)
from mcmj.utils.colours import GROUP_COLOURS, TARGET_COLOUR


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    found = {}
    if result.seeds is not None:
        found["success_rate"] = success_figure(result.seeds)
    if result.tasks:
        found["limit_cycle"] = limit_cycle_figure(result)
    return found


def limit_cycle_figure(result: Result) -> Figure:
    """Fig. 5: for each task the first and last part of its free run, its phase plane; the body."""
    tasks, free_run, window = result.tasks, result.config.free_run, result.config.window
    figure = new_figure(12.5, 2.8 * len(tasks) + 0.7)
    grid = figure.add_gridspec(len(tasks), 4, width_ratios=[1.6, 1.6, 1.0, 1.35])
    for row, task in enumerate(tasks.values()):
        target, times, outputs = task.target, task.times, task.outputs
        start, step = times[0], times[1] - times[0]
        shown = min(round(window / step), len(times))
        first, last, plane = (figure.add_subplot(grid[row, column]) for column in range(3))
        wanted = target.sample(times[:shown])
        draw_outputs(first, times[:shown] - start, outputs[:shown], wanted)
        end = outputs[-shown:]
        shift = best_phase(end, target, times[-shown:])
        draw_outputs(last, times[-shown:] - start, end, target.sample(times[-shown:] + shift))
        draw_phase_plane(plane, end, target)
        first.set_ylabel("outputs")
        first.set_title(f"{TITLES.get(target.name, target.name)}: loop closed at 0 s")
        last.set_title(f"last {window:g} s of {free_run:g} s (target moved by {shift:+.2f} s)")
        plane.set_title(
            f"orbit error {100 * task.errors['orbit_error']:.2f} %\n"
            f"period error {100 * task.errors['period_error']:.3f} %"
        )
        if row == 0:
            handles = output_handles(outputs.shape[1])
            figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    draw_network(figure.add_subplot(grid[:, 3]), result.body)
    return figure


def success_figure(seeds: SuccessOfSeeds) -> Figure:
    """Orbit errors of many bodies, sorted, one curve a task; failures stand above the line."""
    threshold = seeds.threshold
    figure = new_figure(7.5, 4.2)
    axes = figure.add_subplot()
    top = 2.0  # everything worse, blow-ups too, is drawn here
    for (name, errors), colour in zip(seeds.orbit_errors.items(), GROUP_COLOURS, strict=False):
        good = int((errors < threshold).sum())
        axes.semilogy(
            np.arange(1, len(errors) + 1), np.sort(np.minimum(errors, top)), ".-", ms=4, lw=0.8,
            color=colour, label=f"{TITLES.get(name, name)}: {good} of {len(errors)}",
        )  # fmt: skip
    label = f"success below {100 * threshold:g} %"
    axes.axhline(threshold, color=TARGET_COLOUR, ls="--", lw=1, label=label)
    axes.set(xlabel="body, sorted by error (each task for itself)", ylabel="orbit error")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    count_in_whole_numbers(axes)
    return figure
