"""What else is tried with the first robot, each part with one gait."""

from collections.abc import Callable

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.trunk.config import Config
from mcmj.experiments.trunk.result import LearnedGait, Table, fell, forward_speed
from mcmj.metrics import orbits as metrics
from mcmj.robots.force_learning import learn_by_regression, trial_error
from mcmj.robots.trunk_walker import TIMESTEP, TrunkWalker
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array


def by_regression(
    config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps
) -> Table:
    """Orbit error of a free run after plain regression, infinite if the robot falls."""
    gait = gaits[name]
    walker = TrunkWalker(gait.trunk)
    try:
        fit = learn_by_regression(
            walker, gait.target, config.learning, duration=config.teaching, seed=config.seed
        )
        error = trial_error(walker, gait.target, config.walking)
    except DivergenceError:
        return {"train_nrmse": None, "orbit_error": np.inf}
    on_steps(round((config.learning.washout + config.teaching + config.walking) / walker.timestep))
    return {"train_nrmse": fit.train_nrmse, "orbit_error": error}


def from_rest(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """The loop is closed while the robot stands: does it start by itself?"""
    gait = gaits[name]
    walker = gait.walker()
    walker.stand()
    walker.close(True)
    table = _end_of(config, gait, walker, config.walking)
    on_steps(round(config.walking / walker.timestep))
    return table


def push(
    config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps
) -> dict[float, int]:
    """How many pushes of each size, both ways at every moment, do not end in a fall."""
    gait = gaits[name]
    walker = gait.walker()
    moments: list[Array] = []
    for _ in range(config.pushes):
        moments.append(walker.state)
        walker.advance(round(gait.target.period / config.pushes / walker.timestep))
    survived = {}
    for impulse in sorted(config.impulses):
        ends = []
        for moment in moments:
            for way in (impulse, -impulse):
                walker.restore(moment)
                ends.append(_end_of(config, gait, walker, config.survive, push=way))
        survived[impulse] = sum(end["falls"] == 0 for end in ends)
        on_steps(round(len(ends) * config.survive / walker.timestep))
    return survived


def switch(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """The readout is replaced by every other gait's while the robot walks."""
    table: Table = {}
    for other in gaits:
        if other != name:
            walker = gaits[name].walker()
            learned = gaits[other].learned
            assert learned is not None
            walker.set_readout(learned.w_out)
            table[other] = _end_of(config, gaits[other], walker, config.survive)
            on_steps(round(config.survive / walker.timestep))
    return table


def step_study(
    config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps
) -> Table:
    """Speed and orbit error of the same readout at other time steps [ms]."""
    table: Table = {}
    for step in config.steps_ms:
        walker = gaits[name].walker(timestep=1e-3 * step)
        table[f"{step:g}"] = _end_of(config, gaits[name], walker, config.walking)
        on_steps(round(config.walking / TIMESTEP))
    return table


def push_summary(config: Config, survived: dict[str, dict[float, int]]) -> Table:
    """Counts by gait and impulse."""
    counts = {
        name: {f"{impulse:g}": count for impulse, count in row.items()}
        for name, row in survived.items()
    }
    return {"survived": counts, "of": 2 * config.pushes}


def _end_of(
    config: Config, gait: LearnedGait, walker: TrunkWalker, duration: float, *, push: float = 0.0
) -> Table:
    """How a walk from now on ends: its last part, half of it at most."""
    walk = or_lost(lambda: walker.walk(duration, push=push), None)
    if walk is None or fell(gait, walk):
        return {"falls": 1, "speed_m_s": None, "orbit_error": None}
    last = walk.after(duration - min(config.judged, duration / 2))
    error = metrics.orbit_error(last.outputs[0], gait.target)
    return {"falls": 0, "speed_m_s": forward_speed(last), "orbit_error": error}


RUNS: dict[str, Callable[[Config, dict[str, LearnedGait], str, OnSteps], object]] = {
    "regression": by_regression,
    "rest": from_rest,
    "push": push,
    "switch": switch,
    "steps": step_study,
}
