"""A robot that an input steers: it learns, is told values of the input, and follows a path."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.trunk.result import Table
from mcmj.learning.force_learning import Learned, force_learn
from mcmj.robots.steering import (
    TELL,
    PointFollower,
    Steered,
    operate,
    steered_error,
    steered_gait,
    straight_curvature,
)
from mcmj.robots.trunk import Trunk, draw_trunk
from mcmj.robots.trunk_walker import has_fallen, new_robot, poses, stand
from mcmj.robots.walk_metrics import Walk, headings
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

TRIED = (-0.8, 0.0, 0.8)  # inputs of a trial while learning
SETTLE = 2.0  # s after a change of the input that is not measured
LONGEST = 150.0  # s, on a path


@dataclass(frozen=True)
class Path:
    """A walk through points (n, 2), and the inputs (m,) that led it there."""

    points: Array
    walk: Walk
    inputs: Array


@dataclass(frozen=True)
class SteeredRobot:
    """What has been learned, and how it followed a path; None: it fell, or there was none."""

    trunk: Trunk
    steered: Steered
    learned: Learned | None
    table: Table
    path: Path | None = None

    def robot(self) -> Reservoir:
        """Walking, at the end of its learning."""
        assert self.learned is not None
        robot = new_robot(self.trunk)
        robot.set_readout(self.learned.w_out)
        robot.restore(self.learned.state)
        return robot


def learn_steered(config: Config, chosen: tuple[int, str], on_steps: OnSteps) -> SteeredRobot:
    """One robot, by its seed, learns to be steered, by "turn" or "speed", and is measured."""
    seed, steer = chosen
    trunk = draw_trunk(seed, config.steered_trunk(steer))
    duration, hold = config.steering
    straight = straight_curvature(trunk, config.steered, config.pace)
    steered = steered_gait(
        trunk, config.steered, config.pace, straight, seed, duration=duration, hold=hold
    )
    robot = new_robot(trunk)
    led = config.learning.washout + duration / 3  # the teacher shows many inputs first
    learning = replace(config.learning, warm_up=led, rounds=2, round_duration=duration / 3)
    try:
        learned = force_learn(
            robot, steered.target, learning, seed=seed, stand=lambda: stand(robot),
            inputs=steered.inputs,
            judge=partial(
                steered_error, robot, trunk, steered, TRIED, learning.trial / len(TRIED)
            ),
            on_steps=on_steps,
        )  # fmt: skip
    except DivergenceError:
        return SteeredRobot(trunk, steered, None, {"falls": 1})
    found = SteeredRobot(trunk, steered, learned, {})
    table = told(config, found, on_steps)
    if steer == "turn" and not table["falls"]:
        straight = float(np.interp(0.0, *_by_turn(table)))
        path = follow(config, found, straight)
        return replace(found, table=table | _path_table(config, path), path=path)
    return replace(found, table=table)


def told(config: Config, found: SteeredRobot, on_steps: OnSteps) -> Table:
    """Speed and turning at constant inputs, one after the other in one walk."""
    robot, trunk, failed = found.robot(), found.trunk, has_fallen(found.trunk)
    rows: Table = {"falls": 0, "told": list(config.told), "speeds_m_s": [], "turns_deg_s": []}
    settle, steps = (round(time / robot.timestep) for time in (SETTLE, config.judged / 2))
    for u in config.told:
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
    robot, (radius, near) = found.robot(), config.points
    pose = poses(found.trunk, robot.qpos)
    heading = headings(pose[None])[0]
    turned = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    points = pose[:2] + figure_of_eight(radius) @ turned
    operator = PointFollower(points, config.gain, near, straight)
    return Path(points, *operate(robot, found.trunk, LONGEST, operator, lambda: operator.done))


def _path_table(config: Config, path: Path) -> Table:
    """How near to its points the robot came, at worst."""
    middle = path.walk.trunk[0, :, :2]
    apart = np.linalg.norm(middle[:, None] - path.points, axis=-1).min(axis=0)
    return {
        "path_error_m": float(apart.max()),
        "points_passed": int((apart < config.points[1]).sum()),
        "points": len(path.points),
        "path_duration_s": TELL * len(path.inputs),
    }
