"""Which foot stands when: bars over time, a row a leg."""

import numpy as np
from matplotlib.axes import Axes

from mcmj.robots.walk_metrics import Walk
from mcmj.targets.gaits import LEGS

BAR = 0.7  # height of a bar


def draw_stance(axes: Axes, walk: Walk) -> None:
    """A bar for each foot while it bears load, over the time since the walk's first sample [s]."""
    times = walk.times - walk.times[0]
    for leg in range(len(LEGS)):
        down = np.r_[False, walk.contact[0, :, leg] > 0, False].astype(int)
        edges = np.flatnonzero(np.diff(down)).reshape(-1, 2)
        spans = [(times[a], times[b - 1] - times[a]) for a, b in edges]
        axes.broken_barh(spans, (len(LEGS) - 1 - leg - BAR / 2, BAR), facecolors="black", lw=0)
    name_legs(axes)


def name_legs(axes: Axes) -> None:
    """The legs in their order, the first at the top, in a panel without a frame."""
    axes.set_yticks(np.arange(len(LEGS))[::-1], LEGS)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
