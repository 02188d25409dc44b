"""Figures in the manner of the paper's. Takes results, never simulates."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from mcmj.core.body import Body
from mcmj.metrics.orbits import ORBIT_POINTS
from mcmj.mjcf.appearance import node_colour, node_kinds
from mcmj.targets.limit_cycles import Target
from mcmj.utils.colours import (
    BLACK,
    BLUE,
    TARGET_COLOUR,
)
from mcmj.utils.files import whole_file
from mcmj.utils.validation import Array

OUTPUT_STYLES: tuple[dict[str, Any], ...] = (
    {"color": BLACK, "ls": "-"},
    {"color": BLUE, "ls": "--"},
)
INTEGRATOR_MARKS = {
    "Euler": "o",
    "RK4": "D",
    "implicit": "^",
    "implicitfast": "v",
    "discrete": "s",
    "leapfrog": "o",
}


TARGET_STYLE: dict[str, Any] = {"color": TARGET_COLOUR, "lw": 3.0, "alpha": 0.55}
TITLES = {
    "van_der_pol": "Van der Pol",
    "quadratic": "Quadratic limit cycle",
    "lissajous": "Lissajous 3:2",
}


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] that needs no display and no global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure as PNG, whole or not at all."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=130, format="png", pil_kwargs={"compress_level": 3})


def draw_network(axes: Axes, body: Body) -> None:
    """The network: springs, and nodes in the colours of their roles, with a legend.

    A body in space is seen along z.
    """
    flat = body.positions[:, :2]
    lines = flat[body.springs]
    axes.add_collection(LineCollection(list(lines), colors="0.6", linewidths=1.0))
    for node, (x, y) in enumerate(flat):
        marker = "s" if body.fixed[node] else "o"
        axes.plot(x, y, marker, color=node_colour(body, node), ms=7, mec="black", mew=0.5)
    handles = [
        Line2D(
            [], [], ls="", marker="s" if name == "fixed" else "o", color=colour, mec="black",
            mew=0.5, label=name,
        )
        for name, colour in node_kinds(body).items()
    ]  # fmt: skip
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False
    )
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.set_title(f"The body: {body.n_nodes} nodes, {body.n_springs} springs")
    axes.margins(0.06)


def draw_outputs(axes: Axes, times: Array, outputs: Array, wanted: Array) -> None:
    """Outputs (T, n) over time on their targets, T >= 2; times [s]."""
    for c in range(outputs.shape[1]):
        axes.plot(times, wanted[:, c], **TARGET_STYLE)
        axes.plot(times, outputs[:, c], lw=1.3, **OUTPUT_STYLES[c % 2], label=f"$x_{c + 1}$")
    axes.set(xlabel="time in closed loop [s]", xlim=(times[0], 2 * times[-1] - times[-2]))
    axes.locator_params(axis="x", nbins=5)


def output_handles(n_outputs: int) -> list[Line2D]:
    """For a legend: the target and the outputs."""
    return [
        Line2D([], [], **TARGET_STYLE, label="target"),
        *(
            Line2D([], [], **OUTPUT_STYLES[c % 2], label=f"output $x_{c + 1}$")
            for c in range(n_outputs)
        ),
    ]


def draw_phase_plane(axes: Axes, outputs: Array, target: Target) -> None:
    """The generated orbit (first two outputs) on the target's."""
    draw_orbit(axes, target)
    axes.plot(outputs[:, 0], outputs[:, 1], color="black", lw=0.8)


def draw_orbit(axes: Axes, target: Target) -> None:
    """The target's orbit in the phase plane of the first two outputs, as wide as it is high."""
    orbit = target.orbit(ORBIT_POINTS)
    axes.plot(*orbit[np.r_[:ORBIT_POINTS, 0], :2].T, **TARGET_STYLE)
    axes.set(xlabel="$x_1$", ylabel="$x_2$")
    # by its limits: a box as narrow as some orbits has no room for ticks
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.locator_params(nbins=4)


def count_in_whole_numbers(axes: Axes) -> None:
    """Ticks of an x axis that counts: there are no 1.25 bodies."""
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def best_phase(outputs: Array, target: Target, times: Array) -> float:
    """Time shift of the target that fits the outputs best: phases drift apart, shapes do not."""
    sparse = slice(None, None, max(1, len(times) // 400))
    shifts = np.linspace(-0.5, 0.5, 401) * target.period
    costs = [((target.sample(times[sparse] + s) - outputs[sparse]) ** 2).mean() for s in shifts]
    return float(shifts[int(np.argmin(costs))])


mpl.rcParams.update({"axes.titlesize": 10, "axes.labelsize": 9, "legend.fontsize": 9})
