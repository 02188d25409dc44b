"""Gaits: outputs around a switch of the readout (Fig. 9 of the paper), gait diagrams."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mcmj.experiments.gaits.result import BodyResult, Result
from mcmj.metrics.gaits import in_stance
from mcmj.pictures.footfalls import name_legs
from mcmj.pictures.plotting import TARGET_STYLE, best_phase, new_figure
from mcmj.targets.gaits import LEGS
from mcmj.utils.colours import BLACK, CHANGE_COLOUR, RECOVERED_COLOUR, TARGET_COLOUR, Colour
from mcmj.utils.validation import Array

SPACING = 2.6  # between the legs' outputs, which are within +-1.1
THIN = 10  # one sample in so many is drawn
BAR = 0.36  # height of a stance bar
SHOWN = 12.0  # seconds of each gait in the diagram
Pair = tuple[str, str]  # of the gaits before and after a switch


def figures(result: Result) -> dict[str, Figure]:
    """By file name: the first body's switches from the first gait; its gait diagram."""
    first, step, found = result.first, result.config.timestep, {}
    pairs = [
        pair
        for pair, switch in first.switches.items()
        if pair[0] == result.config.gaits[0] and len(switch.outputs)
    ]
    if pairs:
        found["gaits"] = switch_figure(first, pairs, step)
    if any(len(gait.free.outputs) for gait in first.gaits.values()):
        found["gait_diagram"] = gait_diagram(first, pairs, step)
    return found


def switch_figure(body: BodyResult, pairs: Sequence[Pair], timestep: float) -> Figure:
    """Fig. 9: the four outputs around each switch, on the target before it and the one after.

    Args:
        timestep: of the outputs [s].
    """
    figure = new_figure(11.0, 2.9 * len(pairs) + 0.5)
    column = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    for pair, axes in zip(pairs, column, strict=True):
        switch = body.switches[pair]
        times = _times(switch.outputs, switch.switched, timestep)
        first, last = _shown(body, pair, times)
        rows = slice(np.searchsorted(times, first), np.searchsorted(times, last), THIN)
        levels = SPACING * np.arange(len(LEGS))[::-1]
        for wanted_times, wanted in _targets(body, pair, timestep):
            seen = (wanted_times >= first) & (wanted_times <= last)
            axes.plot(wanted_times[seen], wanted[seen] + levels, **TARGET_STYLE)
        axes.plot(times[rows], switch.outputs[rows] + levels, color="black", lw=1.1)
        axes.set_yticks(levels, LEGS)
        axes.set(xlim=(first, last), ylabel="output of leg")
        axes.set_title(_title(body, pair))
        _mark(axes, switch.time)
    column[-1].set_xlabel("time after the switch of the readout [s]")
    figure.legend(
        handles=[
            Line2D([], [], **TARGET_STYLE, label="target"),
            Line2D([], [], color="black", label="output"),
            *_mark_handles(),
        ],
        loc="outside upper center", ncols=4, frameon=False,
    )  # fmt: skip
    return figure


def gait_diagram(body: BodyResult, pairs: Sequence[Pair], timestep: float) -> Figure:
    """Stance bars of each leg: the gaits beside their targets, and around switches.

    Args:
        timestep: of the outputs [s].
    """
    gaits = {name: gait for name, gait in body.gaits.items() if len(gait.free.outputs)}
    wide = -(-len(gaits) // 2)
    figure = new_figure(12.0, 1.75 * (wide + len(pairs)) + 0.8)
    grid = figure.add_gridspec(wide + len(pairs), 2)
    for place, (name, gait) in enumerate(gaits.items()):
        axes = figure.add_subplot(grid[place // 2, place % 2])
        last, target = gait.free.outputs[-round(SHOWN / timestep) :], gait.target
        times = _times(last, 0, timestep)
        wanted = target.sample(times + best_phase(last, target, times))
        _bars(axes, times, wanted, TARGET_COLOUR, below=True)
        _bars(axes, times, last, BLACK)
        _legs(axes, f"{name}, period {target.period:.2f} s", (0.0, SHOWN))
        axes.set_xlabel("time [s]" if place >= len(gaits) - 2 else "")
    for place, pair in enumerate(pairs):
        axes, switch = figure.add_subplot(grid[wide + place, :]), body.switches[pair]
        times = _times(switch.outputs, switch.switched, timestep)
        for wanted_times, wanted in _targets(body, pair, timestep):
            _bars(axes, wanted_times, wanted, TARGET_COLOUR, below=True)
        _bars(axes, times, switch.outputs, BLACK)
        _legs(axes, _title(body, pair), _shown(body, pair, times))
        _mark(axes, switch.time)
    if pairs:
        figure.axes[-1].set_xlabel("time after the switch of the readout [s]")
    handles = [
        Patch(color="black", label="stance (output falls)"),
        Patch(color=TARGET_COLOUR, alpha=0.55, label="target's stance"),
        *(_mark_handles() if pairs else ()),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    return figure


def _times(outputs: Array, origin: int, timestep: float) -> Array:
    """Of samples, with 0 at a row [s]."""
    return np.arange(-origin, len(outputs) - origin, dtype=np.float64) * timestep


def _shown(body: BodyResult, pair: Pair, times: Array) -> tuple[float, float]:
    """Times around a switch that are drawn: two periods before, and until well after arrival."""
    arrival, period = body.switches[pair].time, body.gaits[pair[1]].target.period
    end = arrival + 3 * period if np.isfinite(arrival) else np.inf
    return max(times[0], -2 * period), min(times[-1], max(end, 6 * period))


def _targets(body: BodyResult, pair: Pair, timestep: float) -> list[tuple[Array, Array]]:
    """Times and values of the target before a switch, and of the one after, in best phase.

    The first is fitted to the outputs before the switch, the second to the last periods.
    """
    before, after = (body.gaits[name].target for name in pair)
    outputs, row = body.switches[pair].outputs, body.switches[pair].switched
    parts = []
    for target, begin, end, fitted in (
        (before, 0, row, slice(max(0, row - round(2 * before.period / timestep)), row)),
        (after, row, len(outputs), slice(-round(2 * after.period / timestep), None)),
    ):
        times = _times(outputs, row, timestep)
        shift = best_phase(outputs[fitted], target, times[fitted])
        drawn = times[begin:end:THIN]
        parts.append((drawn, target.sample(drawn + shift)))
    return parts


def _bars(axes: Axes, times: Array, outputs: Array, colour: Colour, *, below: bool = False) -> None:
    stance = in_stance(outputs)
    for leg in range(len(LEGS)):
        bottom = len(LEGS) - 1 - leg - (BAR if below else 0.0)
        edges = np.flatnonzero(np.diff(np.r_[0, stance[:, leg].astype(int), 0]))
        spans = [
            (times[a], times[min(b, len(times) - 1)] - times[a]) for a, b in edges.reshape(-1, 2)
        ]
        axes.broken_barh(
            spans, (bottom, BAR), facecolors=colour, alpha=0.55 if below else 1.0, lw=0
        )


def _legs(axes: Axes, title: str, limits: Sequence[float]) -> None:
    name_legs(axes)
    axes.set(xlim=limits, ylim=(-0.6, len(LEGS) - 0.4), title=title)


def _title(body: BodyResult, pair: Pair) -> str:
    arrival = body.switches[pair].time
    when = f"on the new orbit after {arrival:.1f} s" if np.isfinite(arrival) else "does not arrive"
    return f"{pair[0]} to {pair[1]}: {when}"


def _mark(axes: Axes, arrival: float) -> None:
    axes.axvline(0.0, color=CHANGE_COLOUR, lw=1.8)
    if np.isfinite(arrival):
        axes.axvline(arrival, color=RECOVERED_COLOUR, lw=1.4, ls=":")


def _mark_handles() -> list[Line2D]:
    return [
        Line2D([], [], color=CHANGE_COLOUR, lw=1.8, label="readout switched"),
        Line2D([], [], color=RECOVERED_COLOUR, lw=1.4, ls=":", label="within 5 % from here on"),
    ]
