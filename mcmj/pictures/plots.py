"""A figure in one line: of a body, of a run."""

from matplotlib.figure import Figure

from mcmj.core.body import Body
from mcmj.core.trajectory import Trajectory
from mcmj.pictures.plotting import (
    best_phase,
    draw_network,
    draw_orbit,
    draw_outputs,
    new_figure,
    output_handles,
)
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError

SHOWN = 3  # periods of the target over which outputs are drawn


def plot_body(body: Body) -> Figure:
    """The network: springs, and nodes in the colours of their roles.

    Returns:
        a figure: `.savefig("body.png")`; a notebook shows it.
    """
    figure = new_figure(4.6, 5.0)
    draw_network(figure.add_subplot(), body)
    return figure


def plot_run(run: Trajectory, target: Target) -> Figure:
    """The last outputs of a run over time, and all of them in the plane of the first two.

    The target is moved in time to where it fits best: phases drift apart, shapes do not.

    Args:
        run: with outputs (T, n_outputs), of a reservoir in closed loop.

    Raises:
        InvalidArgumentError: other outputs than the target has.
        UnknownNameError: none recorded.
    """
    outputs, times = run.get("outputs"), run.times
    if outputs.shape[1:] != (target.n_outputs,):
        raise InvalidArgumentError(
            "run", f"outputs (T, {target.n_outputs}) for {target.name}", outputs.shape
        )
    last = slice(max(0, len(times) - round(SHOWN * target.period / (times[1] - times[0]))), None)
    wanted = target.sample(times[last] + best_phase(outputs[last], target, times[last]))
    figure = new_figure(9.0, 3.4)
    over_time, plane = figure.subplots(1, 2, width_ratios=[1.8, 1.0])
    draw_outputs(over_time, times[last], outputs[last], wanted)
    over_time.set(xlabel="time [s]", ylabel="outputs")
    draw_orbit(plane, target)
    plane.plot(outputs[:, 0], outputs[:, 1], color="black", lw=0.8)
    handles = output_handles(outputs.shape[1])
    figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False)
    return figure
