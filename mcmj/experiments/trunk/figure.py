"""A walking trunk: the robot, its muscles' commands, its feet on the ground."""

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from mcmj.experiments.trunk.result import LearnedGait, Result
from mcmj.pictures.footfalls import draw_stance
from mcmj.pictures.plotting import OUTPUT_STYLES, TARGET_STYLE, best_phase, new_figure
from mcmj.robots.trunk import Trunk
from mcmj.robots.walk_metrics import Walk
from mcmj.targets.gaits import LEGS
from mcmj.targets.limit_cycles import Target
from mcmj.utils.colours import MUSCLE_COLOUR

PERIODS = 3.0  # of each gait that are shown


def figures(result: Result) -> dict[str, Figure]:
    """By file name; none if no gait was learned."""
    learned = any(gait.walk is not None for gait in result.gaits.values())
    return {"trunk": trunk_figure(result)} if learned else {}


def trunk_figure(result: Result) -> Figure:
    """The robot as drawn; below, gait by gait, commands of a fore leg on their target, and feet."""

    def draw(figure: Figure, place: SubplotSpec) -> Axes:
        axes = figure.add_subplot(place)
        draw_trunk_body(axes, next(iter(result.gaits.values())).trunk)
        return axes

    return draw_gaits(result.gaits, draw)


def draw_gaits(
    gaits: dict[str, LearnedGait], draw_robot: Callable[[Figure, SubplotSpec], Axes]
) -> Figure:
    """Commands and feet of the gaits that were learned, below what `draw_robot` draws."""
    walks = {
        name: (gait.target, gait.walk) for name, gait in gaits.items() if gait.walk is not None
    }
    figure = new_figure(3.1 * max(2, len(walks)), 7.4)
    grid = figure.add_gridspec(3, len(walks), height_ratios=(1.5, 1.2, 0.8))
    robot = draw_robot(figure, grid[0, :])
    lines = dict(zip(*reversed(robot.get_legend_handles_labels()), strict=True))
    for column, (name, (target, walk)) in enumerate(walks.items()):
        last = walk.after(walk.times[-1] - PERIODS * target.period)
        commands = figure.add_subplot(grid[1, column])
        _commands(commands, name, target, last)
        feet = figure.add_subplot(grid[2, column], sharex=commands)
        draw_stance(feet, last)
        feet.set(xlabel="time [s]")
        if column == 0:
            feet.set_ylabel("feet on the ground")
            commands.set_ylabel("change of length [mm]")
            lines |= dict(zip(*reversed(commands.get_legend_handles_labels()), strict=True))
        commands.tick_params(labelbottom=False)
    figure.legend(lines.values(), lines, loc="outside upper center", ncols=3, frameon=False)
    return figure


def draw_trunk_body(axes: Axes, trunk: Trunk) -> None:
    """Trunk, muscles, feet and ground, labelled for a legend."""
    body, n = trunk.body, trunk.settings.nodes
    lines = list(body.positions[body.springs])
    springs, muscles = lines[: trunk.n_sensed], lines[trunk.n_sensed :]
    axes.add_collection(LineCollection(springs, colors="0.55", lw=1.0, label="springs, sensed"))
    axes.add_collection(
        LineCollection(muscles, colors=MUSCLE_COLOUR, lw=2.2, label="muscles, driven")
    )
    axes.plot(*body.positions[:n].T, "o", color="0.3", ms=4)
    axes.plot(*body.positions[n:].T, "o", color="black", ms=7, label="feet")
    axes.axhline(-trunk.settings.foot, color="0.4", lw=1.5)
    for leg, (x, y) in zip(LEGS, body.positions[n:], strict=True):
        axes.annotate(leg, (x, y), (10, 2), textcoords="offset points", fontsize=8)
    axes.set(aspect="equal", xlabel="x [m], forwards", ylabel="height [m]")
    axes.set_title(f"The robot: {n} nodes, {trunk.n_sensed} springs, {trunk.mass:g} kg")
    axes.margins(0.05)
    axes.spines[["right", "top"]].set_visible(False)


def _commands(axes: Axes, name: str, target: Target, walk: Walk) -> None:
    times = walk.times - walk.times[0]
    outputs = walk.outputs[0]
    phase = best_phase(outputs, target, times)
    wanted = target.sample(times + phase)
    for muscle, style in enumerate(OUTPUT_STYLES):
        axes.plot(times, 1e3 * wanted[:, muscle], **TARGET_STYLE,
                  label="target" if muscle == 0 else None)  # fmt: skip
        label = f"LF, {('fore', 'rear')[muscle]} muscle"
        axes.plot(times, 1e3 * outputs[:, muscle], **style, lw=1.2, label=label)
    axes.set(title=name, xlim=(0, times[-1]))
    axes.spines[["right", "top"]].set_visible(False)
