"""What a body computes from its input: the filters, and the switch that needs feedback."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from mcmj.experiments.filters.config import IN_SYMBOLS, TIMESTEP
from mcmj.experiments.filters.result import Result
from mcmj.experiments.filters.switching import SwitchResult
from mcmj.learning.filters import FilterResult
from mcmj.pictures.plotting import OUTPUT_STYLES, TARGET_STYLE, new_figure

SHOWN_SECONDS, SHOWN_SYMBOLS = 3.0, 80
TITLES = {
    "volterra": "Quadratic Volterra operator",
    "toolbox_narma": "The toolbox's NARMA, 1 ms",
    "narma10": "NARMA-10",
    "delayed_recall": "Delayed recall",
}


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    found = {}
    if result.filters:
        found["filters"] = filter_figure(result.filters)
    if result.switch is not None:
        found["switch"] = switch_figure(result.switch)
    return found


def filter_figure(filters: Mapping[str, FilterResult]) -> Figure:
    """A row a task: outputs on targets, and the errors as bars."""
    figure = new_figure(12.5, 2.3 * len(filters) + 0.5)
    grid = figure.subplots(len(filters), 2, squeeze=False, width_ratios=[3.2, 1.0])
    for (name, one), (left, right) in zip(filters.items(), grid, strict=True):
        counted = name in IN_SYMBOLS
        spacing = 1.0 if counted else TIMESTEP
        shown = round((SHOWN_SYMBOLS if counted else SHOWN_SECONDS) / spacing)
        places = spacing * np.arange(len(one.wanted))[:shown]
        drawn = "steps-mid" if counted else "default"
        left.plot(places, one.wanted[:shown], **TARGET_STYLE, drawstyle=drawn, label="target")
        left.plot(places, one.outputs[:shown], lw=1.2, drawstyle=drawn, **OUTPUT_STYLES[0],
                  label="body")  # fmt: skip
        left.set(xlabel="symbol" if counted else "time [s]", xlim=(places[0], places[-1]))
        left.set_ylabel("output")
        left.set_title(f"{TITLES.get(name, name)}, held-out data")
        kinds = {"body": "", "input and\ndelays": "baseline_", "input\nonly": "input_only_"}
        values = [one.errors[f"{kind}nrmse_std"] for kind in kinds.values()]
        bars = right.bar(list(kinds), values, color=["black", "0.6", "0.8"], width=0.6)
        right.bar_label(bars, fmt="%.2g", fontsize=8)
        right.set(ylim=(0, 1.2), ylabel="NRMSE (std)")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2,
                  frameon=False)  # fmt: skip
    return figure


def switch_figure(switch: SwitchResult) -> Figure:
    """The switch's pulses, and the outputs (T, 1) with and without feedback on the target."""
    figure = new_figure(12.5, 6.0)
    axes = figure.subplots(3, 1, sharex=True, height_ratios=[0.6, 1, 1])
    task = switch.task
    times = TIMESTEP * np.arange(len(task.inputs))
    axes[0].plot(times, task.inputs, color="0.3", lw=1)
    axes[0].set(ylabel="input", title="Pulses")
    names = {"feedback": "With feedback", "open": "Without feedback"}
    for panel, (name, title) in zip(axes[1:], names.items(), strict=True):
        panel.plot(times, task.targets, **TARGET_STYLE, label="target")
        panel.plot(times, switch.outputs[name], lw=1.0, **OUTPUT_STYLES[0], label="output")
        share = 100 * switch.held[name]
        panel.set_title(f"{title}: right throughout {share:.0f} % of the pauses")
        panel.set(ylabel="output", ylim=(-2, 2))
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside upper center", ncols=2,
                  frameon=False)  # fmt: skip
    axes[-1].set(xlabel="time [s]", xlim=(times[0], times[-1]))
    return figure
