"""A search for an input signal: rewards by round, and outputs without and with it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.drive.result import Episode, Result
from mcmj.pictures.plotting import (
    OUTPUT_STYLES,
    TITLES,
    count_in_whole_numbers,
    draw_phase_plane,
    new_figure,
)
from mcmj.utils.colours import BLUE, GREEN, RED
from mcmj.utils.validation import Array


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"drive": drive_figure(result)}


def drive_figure(result: Result) -> Figure:
    """Learning curve; outputs over time and phase plane without input and with the learned one."""
    target = result.target
    figure = new_figure(12.0, 6.2)
    grid = figure.add_gridspec(2, 3, width_ratios=[1.1, 1.9, 1.0])
    _draw_learning(figure.add_subplot(grid[:, 0]), result.rewards, result.before.mean_reward)
    episodes = {"without input": result.before, "learned input": result.after}
    for row, (name, episode) in enumerate(episodes.items()):
        time_axes, plane = figure.add_subplot(grid[row, 1]), figure.add_subplot(grid[row, 2])
        _draw_episode(time_axes, episode)
        time_axes.set_title(f"{name}, from total rest: mean reward {episode.mean_reward:.2f}")
        draw_phase_plane(plane, episode.outputs, target)
        plane.set_title(TITLES.get(target.name, target.name) if row == 0 else "")
        if row == 1:
            time_axes.set_xlabel("time [s]")
            time_axes.legend(
                loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=3, frameon=False
            )
    return figure


def _draw_learning(axes: Axes, rewards: Array, without: float) -> None:
    rounds = 1 + np.arange(len(rewards))
    axes.plot(rounds, rewards, ".", color="0.75", ms=4)
    axes.plot(rounds, rewards.max(axis=1), "o-", color="black", label="best of the round")
    axes.plot(rounds, np.median(rewards, axis=1), "s--", color=BLUE, label="median")
    axes.axhline(without, color=RED, ls=":", label="without input")
    axes.set(xlabel="round", ylabel="mean reward of an episode", ylim=(0.0, 1.0))
    axes.set_title(f"cross-entropy method, {rewards.shape[1]} episodes a round")
    axes.legend(loc="lower right")
    count_in_whole_numbers(axes)


def _draw_episode(axes: Axes, episode: Episode) -> None:
    times, inputs, outputs = episode.times, episode.inputs, episode.outputs
    for c in range(outputs.shape[1]):
        axes.plot(times, outputs[:, c], lw=1.2, **OUTPUT_STYLES[c % 2], label=f"$x_{c + 1}$")
    largest = np.abs(inputs).max()
    if largest > 0.0:
        scaled = inputs * (np.abs(outputs).max() / largest)
        label = f"input (largest: {largest:.1f})"
        axes.fill_between(times, scaled, color=GREEN, alpha=0.3, lw=0, label=label)
    axes.set(ylabel="outputs", xlim=(0.0, times[-1]))
