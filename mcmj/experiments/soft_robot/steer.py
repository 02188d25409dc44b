"""A robot that an input steers: it learns, is told values of the input, and follows a path."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.trunk.result import Table
from mcmj.learning.force_learning import Learned, force_learn
from mcmj.robots.steering import (
    LOWEST,
    TELL,
    PointFollower,
    course_of_inputs,
    operate,
    steered_error,
    steering_bias,
    straight_curvature,
)
from mcmj.robots.trunk import Trunk, draw_trunk, muscle_target
from mcmj.robots.trunk_walker import has_fallen, new_robot, poses, stand
from mcmj.robots.walk_metrics import Walk, fallen, headings
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

TRIED = 3  # inputs of a trial while learning
SETTLE = 2.0  # s after a change of the input that is not measured
LONGEST = 300.0  # s, on a path


@dataclass(frozen=True)
class Path:
    """A walk by points (n, 2), and the inputs (m,) that led it there.

    Attributes:
        apart: (n,) least distance from each point, between the one before and the one after
            [m]; infinite for a point that was not come by.
        fell: whether the robot fell on its way.
    """

    points: Array
    walk: Walk
    inputs: Array
    apart: Array
    fell: bool


@dataclass(frozen=True)
class SteeredRobot:
    """What has been learned, and how it followed a path; None: not learned, not followed."""

    trunk: Trunk
    steer: str
    learned: Learned | None
    table: Table
    path: Path | None = None

    def robot(self) -> Reservoir:
        """Walking, at the end of its learning."""
        assert self.learned is not None
        robot = new_robot(self.trunk, bias=steering_bias(self.trunk, self.steer))
        robot.set_readout(self.learned.w_out)
        robot.restore(self.learned.state)
        return robot


def learn_steered(config: Config, chosen: tuple[int, str], on_steps: OnSteps) -> SteeredRobot:
    """One robot, by its seed, learns under inputs that "turn" or "brake" it, and is measured."""
    seed, steer = chosen
    trunk = draw_trunk(seed, config.trunk)
    straight = straight_curvature(trunk, config.steered, config.pace)
    target = muscle_target(trunk, config.steered, config.pace, curvature=straight)
    robot = new_robot(trunk, bias=steering_bias(trunk, steer))
    tried = np.linspace(LOWEST[steer], 1.0, TRIED).tolist()
    judge = partial(steered_error, robot, trunk, target, tried, config.learning.trial / 2)
    learned = or_lost(
        lambda: force_learn(
            robot, target, config.learning, seed=seed, stand=lambda: stand(robot),
            inputs=course_of_inputs(steer, seed, config.hold), judge=judge, on_steps=on_steps,
        ),
        None,
    )  # fmt: skip
    found = SteeredRobot(trunk, steer, learned, {"falls": 1})
    return found if learned is None else _measured(config, found, on_steps)


def _measured(config: Config, found: SteeredRobot, on_steps: OnSteps) -> SteeredRobot:
    """With its table, and with the path if it can turn."""
    table = told(config, found, on_steps)
    if found.steer == "turn" and not table["falls"]:
        path = or_lost(lambda: follow(config, found, float(np.interp(0.0, *_by_turn(table)))), None)
        if path is not None:
            return replace(found, table=table | _path_table(config, path), path=path)
    return replace(found, table=table)


def told(config: Config, found: SteeredRobot, on_steps: OnSteps) -> Table:
    """Speed and turning at constant inputs, one after the other in one walk."""
    robot, trunk, failed = found.robot(), found.trunk, has_fallen(found.trunk)
    inputs = [u for u in config.told if u >= LOWEST[found.steer]]
    rows: Table = {"falls": 0, "told": inputs, "speeds_m_s": [], "turns_deg_s": []}
    settle, steps = (round(time / robot.timestep) for time in (SETTLE, config.judged / 2))
    for u in inputs:
        given = np.full((settle + steps, 1), u)
        try:
            run = robot.rollout(inputs=given, record=("qpos",))
        except DivergenceError:
            return rows | {"falls": 1}
        if failed(run):
            return rows | {"falls": 1}
        on_steps(settle + steps)
        pose = poses(trunk, run.get("qpos")[settle::25])
        heading = headings(pose)
        ahead = np.column_stack([np.cos(heading), np.sin(heading)])[:-1]
        way = (np.diff(pose[:, :2], axis=0) * ahead).sum()
        duration = 25 * robot.timestep * (len(pose) - 1)
        rows["speeds_m_s"].append(float(way / duration))  # type: ignore[attr-defined]  # a list
        turn = float(np.degrees(heading[-1] - heading[0]) / duration)
        rows["turns_deg_s"].append(turn)  # type: ignore[attr-defined]  # a list
    return rows


def _by_turn(table: Table) -> tuple[Array, Array]:
    """Turning rates in order, and the inputs of each."""
    turns, inputs = (np.array(table[name]) for name in ("turns_deg_s", "told"))
    order = np.argsort(turns)
    return turns[order], inputs[order]


def figure_of_eight(radius: float, points: int = 16) -> Array:
    """Places (points, 2) [m] on two circles that touch at the start, along x there."""
    angle = np.linspace(0.0, 2 * np.pi, points // 2 + 1)[1:]
    left = np.column_stack([radius * np.sin(angle), radius * (1 - np.cos(angle))])
    return np.vstack([left, left * [1.0, -1.0]])


def follow(config: Config, found: SteeredRobot, straight: float) -> Path:
    """Through the points of a figure of eight, which begins where and as the robot walks."""
    robot, (radius, near) = found.robot(), config.eight
    pose = poses(found.trunk, robot.qpos)
    heading = headings(pose[None])[0]
    turned = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    points = pose[:2] + figure_of_eight(radius) @ turned
    operator = PointFollower(points, config.gain, near, straight)
    walk, inputs = operate(robot, found.trunk, LONGEST, operator, lambda: operator.done)
    fell = bool(fallen(walk.trunk[0], found.trunk.settings.leg).any())
    return Path(points, walk, inputs, distances_in_order(walk, operator), fell)


def distances_in_order(walk: Walk, operator: PointFollower) -> Array:
    """Least distance (n,) [m] from each point of an operator who has led a walk."""
    apart = np.full(len(operator.points), np.inf)
    moments = np.array([0, *operator.calls, np.inf]) * TELL  # when the one before was passed
    times = walk.times - walk.times[0]
    for k, point in enumerate(operator.points[: len(operator.calls)]):
        there = (times >= moments[k]) & (times <= moments[k + 2])
        apart[k] = np.linalg.norm(walk.trunk[0, there, :2] - point, axis=-1).min()
    return apart


def _path_table(config: Config, path: Path) -> Table:
    """How near to its points the robot came, at worst."""
    return {
        "path_error_m": float(path.apart.max()),
        "points_passed": int((path.apart < config.eight[1]).sum()),
        "points": len(path.points),
        "path_duration_s": TELL * len(path.inputs),
        "path_falls": int(path.fell),
    }
