"""What else is tried with the first robot, each part with one gait."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.trunk.config import Config
from mcmj.experiments.trunk.result import LearnedGait, Table, fell, forward_speed
from mcmj.learning.force_learning import force_learn
from mcmj.learning.free_run import trial_error
from mcmj.metrics import orbits as metrics
from mcmj.robots.trunk_walker import has_fallen, new_robot, stand, walk
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array


def by_regression(
    config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps
) -> Table:
    """Orbit error of a free run after plain regression, infinite if the robot falls."""
    gait, washout = gaits[name], config.learning.washout
    robot, trunk = new_robot(gait.trunk), gait.trunk
    learning = replace(config.learning, warm_up=washout + config.teaching, rounds=0)
    try:
        force_learn(
            robot, gait.target, learning, seed=config.seed, stand=lambda: stand(robot),
            on_steps=on_steps,
        )  # fmt: skip
    except DivergenceError:
        return {"orbit_error": np.inf}
    error = trial_error(robot, gait.target, config.walking, has_fallen(trunk), on_steps=on_steps)
    return {"orbit_error": error}


def from_rest(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """The loop is closed while the robot stands: does it start by itself?"""
    robot = gaits[name].robot()
    stand(robot)
    table = end_of(config, gaits[name], robot, config.walking)
    on_steps(round(config.walking / robot.timestep))
    return table


def push(
    config: Config,
    gaits: dict[str, LearnedGait],
    name: str,
    on_steps: OnSteps,
    axis: int = 0,
) -> dict[float, int]:
    """How many pushes of each size, both ways at every moment, do not end in a fall."""
    gait = gaits[name]
    robot = gait.robot()
    moments: list[Array] = []
    for _ in range(config.pushes):
        moments.append(robot.snapshot())
        robot.rollout(round(gait.target.period / config.pushes / robot.timestep), record=())
    survived = {}
    for impulse in sorted(config.impulses):
        ends = []
        for moment in moments:
            for way in (impulse, -impulse):
                robot.restore(moment)
                ends.append(end_of(config, gait, robot, config.survive, push=way, axis=axis))
        survived[impulse] = sum(end["falls"] == 0 for end in ends)
        on_steps(round(len(ends) * config.survive / robot.timestep))
    return survived


def switch(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """The readout is replaced by every other gait's while the robot walks."""
    table: Table = {}
    for other in gaits:
        if other != name:
            robot = gaits[name].robot()
            learned = gaits[other].learned
            assert learned is not None
            robot.set_readout(learned.w_out)
            table[other] = end_of(config, gaits[other], robot, config.survive)
            on_steps(round(config.survive / robot.timestep))
    return table


def step_study(
    config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps
) -> Table:
    """Speed and orbit error of the same readout at other time steps [ms]."""
    table: Table = {}
    for step in config.steps_ms:
        robot = gaits[name].robot(1e-3 * step)
        table[f"{step:g}"] = end_of(config, gaits[name], robot, config.walking)
        on_steps(round(config.walking / robot.timestep))
    return table


def push_summary(config: Config, survived: dict[str, dict[float, int]]) -> Table:
    """Counts by gait and impulse."""
    counts = {
        name: {f"{impulse:g}": count for impulse, count in row.items()}
        for name, row in survived.items()
    }
    return {"survived": counts, "of": 2 * config.pushes}


def end_of(
    config: Config,
    gait: LearnedGait,
    robot: Reservoir,
    duration: float,
    *,
    push: float = 0.0,
    axis: int = 0,
) -> Table:
    """How a walk from now on ends: its last part, half of it at most."""
    walked = or_lost(lambda: walk(robot, gait.trunk, duration, push=push, axis=axis), None)
    if walked is None or fell(gait, walked):
        return {"falls": 1, "speed_m_s": None, "orbit_error": None}
    last = walked.after(duration - min(config.judged, duration / 2))
    error = metrics.orbit_error(last.outputs[0], gait.target)
    return {"falls": 0, "speed_m_s": forward_speed(last), "orbit_error": error}


RUNS: dict[str, Callable[[Config, dict[str, LearnedGait], str, OnSteps], object]] = {
    "regression": by_regression,
    "rest": from_rest,
    "push": push,
    "switch": switch,
    "steps": step_study,
}
