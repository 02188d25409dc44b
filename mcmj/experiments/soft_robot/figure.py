"""A soft robot: its body, its muscles' commands, its feet, and where it was steered."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from mcmj.experiments.soft_robot.result import Result
from mcmj.experiments.soft_robot.steer import Path
from mcmj.experiments.trunk.figure import draw_gaits
from mcmj.pictures.plotting import new_figure
from mcmj.robots.trunk import Trunk
from mcmj.utils.colours import BLUE, MUSCLE_COLOUR, TARGET_COLOUR


def figures(result: Result) -> dict[str, Figure]:
    """By file name; none of what was not learned."""
    found = {}
    if any(gait.walk is not None for gait in result.gaits.values()):
        found["soft_robot"] = robot_figure(result)
    measured = {name: robot.table for name, robot in result.steered.items()}
    measured = {name: table for name, table in measured.items() if not table["falls"]}
    if measured:
        found["soft_robot_steer"] = steer_figure(result)
    return found


def robot_figure(result: Result) -> Figure:
    """The robot as drawn; below, gait by gait, commands of a fore leg on their target, and feet."""
    return draw_gaits(result.gaits, lambda figure, place: draw_robot(figure, place, result))


def draw_robot(figure: Figure, place: object, result: Result) -> Axes:
    """Trunk, muscles and feet in space, labelled for a legend."""
    trunk = next(iter(result.gaits.values())).trunk
    axes: Any = figure.add_subplot(place, projection="3d")
    body, n = trunk.body, trunk.settings.nodes
    lines = body.positions[body.springs]
    for part, style in (
        (lines[: trunk.n_sensed], {"colors": "0.55", "lw": 0.8, "label": "springs, sensed"}),
        (lines[trunk.n_sensed :], {"colors": MUSCLE_COLOUR, "lw": 2.0, "label": "muscles, driven"}),
    ):
        axes.add_collection3d(Line3DCollection(part, clip_on=False, **style))
    axes.scatter(*body.positions[:n].T, color="0.3", s=8, depthshade=False, clip_on=False)
    axes.scatter(
        *body.positions[n:].T, color="black", s=28, depthshade=False, clip_on=False, label="feet"
    )
    _place(axes, trunk)
    axes.set_title(f"The robot: {n} nodes, {trunk.n_sensed} springs, {trunk.mass:g} kg")
    found: Axes = axes
    return found


def _place(axes: Any, trunk: Trunk) -> None:
    low, high = trunk.body.positions.min(axis=0), trunk.body.positions.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.1)
    axes.view_init(elev=18, azim=-62)
    axes.set(xlabel="x [m], forwards", zlabel="height [m]")
    axes.set_ylabel("y [m]", labelpad=1.0)
    axes.set_yticks([-0.2, 0.2])
    axes.set_zticks([0.0, 0.4, 0.8])


def steer_figure(result: Result) -> Figure:
    """Turning and speed over the input, and the path through the points of a figure of eight."""
    robots, panels = result.steered, []
    for steer, robot in robots.items():
        if not robot.table["falls"]:
            panels.append((steer, robot))
    path = next((robot.path for _, robot in panels if robot.path is not None), None)
    count = len(panels) + (path is not None)
    figure = new_figure(4.2 * max(count, 1), 3.9)
    axes = figure.subplots(1, count, squeeze=False)[0]
    for panel, (steer, robot) in zip(axes, panels, strict=False):
        name, label = {
            "turn": ("turns_deg_s", "turning, left positive [deg/s]"),
            "brake": ("speeds_m_s", "speed [m/s]"),
        }[steer]
        panel.axhline(0, color="0.8", lw=1)
        panel.plot(robot.table["told"], robot.table[name], "o-", color=BLUE)
        panel.set(
            xlabel="input u",
            ylabel=label,
            title={"turn": "one number turns it", "brake": "one number slows it"}[steer],
        )
        panel.spines[["right", "top"]].set_visible(False)
    if path is not None:
        _draw_path(axes[-1], path)
    return figure


def _draw_path(axes: Axes, path: Path) -> None:
    middle = path.walk.trunk[0, :, :2]
    axes.plot(*middle.T, color=BLUE, lw=1.2, label="trunk")
    axes.plot(*path.points.T, "o", color=TARGET_COLOUR, ms=5, label="points")
    axes.plot(*middle[0], ">", color="black", ms=7, label="start")
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m], left")
    off = path.apart.max()
    told = f"off by {off:.2f} m at most" if off < float("inf") else "not finished"
    axes.set_title(f"a figure of eight: {told}", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.spines[["right", "top"]].set_visible(False)
