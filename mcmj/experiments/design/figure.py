"""Designed bodies beside random ones: errors, bodies tried, numbers of nodes, the best body."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from mcmj.experiments.design.fronts import Fronts
from mcmj.experiments.design.predictors import TOGETHER, Predictors
from mcmj.experiments.design.result import KINDS, Designs, Result
from mcmj.experiments.search.figure import draw_scores
from mcmj.metrics.success_rates import wilson_interval
from mcmj.mjcf.read import from_mjcf
from mcmj.pictures.plotting import TITLES, count_in_whole_numbers, draw_network, new_figure
from mcmj.search.experiment import Score
from mcmj.utils.colours import BLACK, BLUE, GROUP_COLOURS, RED, TARGET_COLOUR

COLOURS = dict(zip(KINDS, GROUP_COLOURS, strict=True))


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    found = {}
    if result.bodies is not None:
        found["design"] = design_figure(result, result.bodies)
    if result.smallest:
        found["smallest"] = smallest_figure(result)
    if result.predictors is not None:
        found["predictors"] = predictors_figure(result, result.predictors)
    if result.fronts is not None:
        found["pareto"] = pareto_figure(result, result.fronts)
    return found


def design_figure(result: Result, designs: Designs) -> Figure:
    """Orbit errors, how many bodies were tried, and the best body, if there is one."""
    xml = result.champions.get("designed")
    figure = new_figure(15.0 if xml else 10.5, 4.6)
    axes = figure.subplots(1, 3 if xml else 2)
    score = Score("orbit error, worst of all noises", designs.threshold)
    draw_scores(axes[0], {KINDS[kind]: designs.errors(kind) for kind in KINDS}, score)
    axes[0].set_title(f"{_title(result)}, {result.config.settings.nodes} nodes")
    _draw_tried(axes[1], designs)
    if xml:
        draw_network(axes[2], from_mjcf(xml)[0])
        axes[2].set_title("The best designed body")
    return figure


def _draw_tried(axes: Axes, designs: Designs) -> None:
    """Share of the designs, and of the searches at random, that ended, against bodies tried."""
    most = max(*designs.evaluations, *designs.search_evaluations)
    for kind, numbers, passed in (
        ("search", designs.search_evaluations, "search_passed"),
        ("designed", designs.evaluations, "passed"),
    ):
        ended = np.sort(np.array(numbers)[[body[passed] for body in designs.bodies]])
        share = np.arange(1, len(ended) + 1) / len(numbers)
        ends = [*ended, most], [*share, len(ended) / len(numbers)]
        axes.step(*ends, where="post", color=COLOURS[kind], label=KINDS[kind])
    axes.set(xscale="log", xlabel="bodies tried", ylabel="share that passed", ylim=(0, 1.02))
    _name_ticks(axes.xaxis)
    axes.set_title("until one passes its checks")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)


def smallest_figure(result: Result) -> Figure:
    """Share of the bodies that learn a task against the number of nodes, a panel for each task."""
    count = len(result.smallest)
    figure = new_figure(1.2 + 4.2 * count, 4.2)
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    for axes, (task, sizes) in zip(panels, result.smallest.items(), strict=True):
        _draw_sizes(axes, sizes)
        axes.set_title(_task_title(task))
    panels[0].set(ylabel="share of the bodies that learn it", ylim=(-0.03, 1.03))
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(KINDS), frameon=False)
    return figure


def _draw_sizes(axes: Axes, sizes: Mapping[int, Designs]) -> None:
    nodes = np.array(sorted(sizes))
    for kind, label in KINDS.items():
        counts = [(sizes[n].successes(kind), len(sizes[n].bodies)) for n in nodes]
        rates = np.array([count / total for count, total in counts])
        spans = np.abs(np.array([wilson_interval(*pair) for pair in counts]).T - rates)
        shift = 0.08 * (list(KINDS).index(kind) - 1)  # bars side by side
        axes.errorbar(
            nodes + shift, rates, yerr=spans, fmt="o-", ms=5, capsize=3, color=COLOURS[kind],
            label=label,
        )  # fmt: skip
    axes.set_xlabel("nodes")
    axes.grid(alpha=0.3)
    count_in_whole_numbers(axes)


def predictors_figure(result: Result, predictors: Predictors) -> Figure:
    """How well each measure of a body before teaching tells whether it will learn."""
    figure = new_figure(7.5, 4.6)
    axes = figure.subplots()
    areas = sorted(predictors.held_out.items(), key=lambda item: item[1])
    names = [name.replace("_", " ") for name, _ in areas]
    colours = [RED if name == TOGETHER else BLUE for name, _ in areas]
    axes.barh(names, [area for _, area in areas], color=colours, height=0.6)
    axes.axvline(0.5, color=BLACK, ls="--", lw=1)
    axes.set(xlabel="area under the ROC curve, held-out bodies (0.5: tells nothing)", xlim=(0.3, 1))
    count = predictors.successes
    axes.set_title(f"{_title(result)}: {count} of {len(predictors.bodies)} random bodies learn it")
    axes.grid(alpha=0.3, axis="x")
    return figure


def pareto_figure(result: Result, fronts: Fronts) -> Figure:
    """Orbit errors without and with noise on the lengths: the fronts of all bodies."""
    figure = new_figure(6.4, 5.0)
    axes = figure.subplots()
    for kind, mark in (("random", "s"), ("designed", "o")):
        for body in fronts.bodies:
            points = np.array(body[kind])
            axes.plot(*points.T, mark + "-", ms=4, lw=1, color=COLOURS[kind], alpha=0.7)
    axes.set(xscale="log", yscale="log", xlabel="orbit error without noise")
    _name_ticks(axes.xaxis)
    _name_ticks(axes.yaxis)
    axes.set_ylabel(f"with noise of {result.config.sensor_noise:g} m on all lengths")
    for line in (axes.axhline, axes.axvline):
        line(fronts.threshold, color=TARGET_COLOUR, ls="--", lw=1)
    handles = [
        Line2D([], [], color=COLOURS[kind], marker=mark, ms=4, label=label)
        for kind, mark, label in (
            ("random", "s", "as many random bodies"),
            ("designed", "o", "designed, three weights"),
        )
    ]
    handles.append(Line2D([], [], color=TARGET_COLOUR, ls="--", label="success is below"))
    axes.legend(handles=handles, frameon=False)
    axes.set_title(f"{_title(result)}: a front for each of {len(fronts.bodies)} bodies")
    axes.grid(alpha=0.3)
    return figure


def _name_ticks(axis: Axis) -> None:
    """Of a logarithmic axis: 1, 2, 5, 10, .."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _title(result: Result) -> str:
    return _task_title(result.config.task)


def _task_title(task: str) -> str:
    """Of a figure."""
    return TITLES.get(task, task.replace("_", " "))
