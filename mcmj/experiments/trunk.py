"""A robot that is its own computer: does it learn to walk, and what does it take?

Robots and gaits are independent and run side by side on threads; nothing depends on how many.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mcmj import metrics, walkmetrics
from mcmj.errors import DivergenceError
from mcmj.experiments.trunk_config import Config
from mcmj.force_learning import Learned, force_learn, learn_by_regression, trial_error
from mcmj.progress import OnSteps
from mcmj.quadruped import GRAVITY
from mcmj.rates import success_rate
from mcmj.targets import Target
from mcmj.threads import in_threads
from mcmj.trunk import Trunk, draw_trunk, muscle_target
from mcmj.trunk_walker import TrunkWalker
from mcmj.validation import Array
from mcmj.walkmetrics import Walk

Table = dict[str, object]
TAUGHT = 0.1  # orbit error below which a gait counts as the one that was taught


@dataclass(frozen=True)
class Gait:
    """One robot that has learned one gait, and its walk; the readout is None if it blew up."""

    trunk: Trunk
    target: Target
    learned: Learned | None
    walk: Walk | None

    def walker(self, **options: object) -> TrunkWalker:
        """The robot in this gait, in closed loop."""
        assert self.learned is not None
        walker = TrunkWalker(self.trunk, **options)  # type: ignore[arg-type]
        walker.set_readout(self.learned.w_out)
        walker.close(True)
        walker.restore(self.learned.state)
        return walker


@dataclass(frozen=True)
class Result:
    """Gaits of the first robot by name, and the metrics of all."""

    config: Config
    gaits: dict[str, Gait]
    metrics: Table


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Let every robot learn every gait and walk, then run the parts with the first one.

    Raises:
        McmjError: a config that MuJoCo does not take.
    """
    robots = [
        (seed, name)
        for seed in range(config.seed, config.seed + config.seeds)
        for name in config.gaits
    ]
    walked = in_threads(partial(learn, config), robots, on_steps)
    found = dict(zip(robots, walked, strict=True))
    gaits = {name: found[config.seed, name] for name in config.gaits}
    table: Table = {name: walk_table(config, gait) for name, gait in gaits.items()}
    if config.seeds > 1:
        table["seeds"] = seeds_table(config, found)
    good = {name: gait for name, gait in gaits.items() if gait.learned is not None}
    for part in config.parts:
        rows = in_threads(partial(_PARTS[part], config, good), tuple(good), on_steps)
        table[part] = dict(zip(good, rows, strict=True))
    if "push" in config.parts:
        table["push"] = push_summary(config, table["push"])  # type: ignore[arg-type]
    return Result(config, gaits, table)


def learn(config: Config, robot: tuple[int, str], on_steps: OnSteps) -> Gait:
    """One robot, by its seed, learns one gait, by its name, and walks."""
    seed, name = robot
    trunk = draw_trunk(seed, config.trunk)
    target = muscle_target(trunk, name, config.pace)
    walker = TrunkWalker(trunk)
    try:
        learned = force_learn(walker, target, config.learning, seed=seed, on_steps=on_steps)
        walk = walker.walk(config.walking)
    except DivergenceError:
        return Gait(trunk, target, None, None)
    on_steps(round(config.walking / walker.timestep))
    return Gait(trunk, target, learned, walk)


def walk_table(config: Config, gait: Gait) -> Table:
    """How a walk went; what a robot that fell did not do is None."""
    if gait.walk is None or gait.learned is None:
        return {"falls": 1}
    walk, trunk = gait.walk, gait.trunk
    last = walk.after(config.walking - config.judged)
    fallen = bool(np.isfinite(walkmetrics.fall_times(walk, trunk.settings.leg)[0]))
    measured = {
        "distance_m": walkmetrics.distances(walk)[0],
        "speed_m_s": walkmetrics.speeds(last)[0],
        "cost_of_transport": walkmetrics.costs_of_transport(last, GRAVITY * trunk.mass)[0],
        "orbit_error": metrics.orbit_error(last.outputs[0], gait.target),
        "stride_period_s": walkmetrics.stride_period(last, gait.target.period),
        "duty_factors": (last.contact[0] > 0).mean(axis=0),
    }
    if fallen:
        measured = dict.fromkeys(measured, None)
    return {
        "falls": int(fallen),
        **measured,
        "taught_period_s": gait.target.period,
        "trial_errors": list(gait.learned.errors),
    }


def seeds_table(config: Config, found: dict[tuple[int, str], Gait]) -> Table:
    """By gait: how many robots walk without a fall, in the gait that was taught; all speeds."""
    table: Table = {}
    for name in config.gaits:
        rows = [walk_table(config, gait) for (_, other), gait in found.items() if other == name]
        errors = [row.get("orbit_error") for row in rows]
        table[name] = {
            "upright": success_rate([row["falls"] == 0 for row in rows]),
            "taught": success_rate([isinstance(e, float) and e < TAUGHT for e in errors]),
            "orbit_errors": errors,
            "speeds": [row.get("speed_m_s") for row in rows],
        }
    return table


# --- parts, each of one gait of the first robot -----------------------------------------------


def by_regression(config: Config, gaits: dict[str, Gait], name: str, on_steps: OnSteps) -> Table:
    """The same robot taught by plain regression: orbit error of a free run, infinite if it falls.

    Ridge and noise are the config's; the teacher's noise is what a regression has against
    its own errors (Hauser et al. 2012, section 4).
    """
    gait = gaits[name]
    walker = TrunkWalker(gait.trunk)
    try:
        fit = learn_by_regression(
            walker, gait.target, config.learning, duration=config.teaching,
            noise=config.teacher_noise, ridge_per_row=config.ridge_per_row, seed=config.seed,
        )  # fmt: skip
        error = trial_error(walker, gait.target, config.walking)
    except DivergenceError:
        return {"train_nrmse": None, "orbit_error": np.inf}
    on_steps(round((config.teaching + config.walking) / walker.timestep))
    return {"train_nrmse": fit.train_nrmse, "orbit_error": error}


def from_rest(config: Config, gaits: dict[str, Gait], name: str, on_steps: OnSteps) -> Table:
    """The loop is closed while the robot stands: does it start by itself?"""
    gait = gaits[name]
    walker = gait.walker()
    walker.stand()
    walker.close(True)
    table = _end_of(config, gait, walker, config.walking)
    on_steps(round(config.walking / walker.timestep))
    return table


def push(config: Config, gaits: dict[str, Gait], name: str, on_steps: OnSteps) -> dict[float, int]:
    """How many pushes of each size a gait survives, and is back in its rhythm after."""
    gait = gaits[name]
    walker = gait.walker()
    survived = {}
    moments: list[Array] = []
    for _ in range(config.pushes):
        moments.append(walker.state)
        walker.advance(round(gait.target.period / config.pushes / walker.timestep))
    for impulse in sorted(config.impulses):
        count = 0
        for k, moment in enumerate(moments):
            walker.restore(moment)
            walk = walker.walk(config.survive, push=impulse if k % 2 else -impulse)
            count += not np.isfinite(walkmetrics.fall_times(walk, gait.trunk.settings.leg)[0])
        survived[impulse] = count
        on_steps(round(config.pushes * config.survive / walker.timestep))
    return survived


def switch(config: Config, gaits: dict[str, Gait], name: str, on_steps: OnSteps) -> Table:
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


def step_study(config: Config, gaits: dict[str, Gait], name: str, on_steps: OnSteps) -> Table:
    """Speed and orbit error of the same readout at other time steps [ms]."""
    table: Table = {}
    for step in config.steps_ms:
        walker = gaits[name].walker(timestep=1e-3 * step)
        table[f"{step:g}"] = _end_of(config, gaits[name], walker, config.walking)
        on_steps(round(config.walking / walker.timestep))
    return table


def push_summary(config: Config, survived: dict[str, dict[float, int]]) -> Table:
    """Counts by gait and impulse."""
    counts = {
        name: {f"{impulse:g}": count for impulse, count in row.items()}
        for name, row in survived.items()
    }
    return {"survived": counts, "of": config.pushes}


def _end_of(config: Config, gait: Gait, walker: TrunkWalker, duration: float) -> Table:
    """How a walk from now on ends: its last part, half of it at most."""
    try:
        walk = walker.walk(duration)
    except DivergenceError:
        return {"falls": 1, "speed_m_s": None, "orbit_error": None}
    fallen = bool(np.isfinite(walkmetrics.fall_times(walk, gait.trunk.settings.leg)[0]))
    last = walk.after(duration - min(config.judged, duration / 2))
    return {
        "falls": int(fallen),
        "speed_m_s": None if fallen else walkmetrics.speeds(last)[0],
        "orbit_error": None if fallen else metrics.orbit_error(last.outputs[0], gait.target),
    }


_PARTS: dict[str, Callable[[Config, dict[str, Gait], str, OnSteps], object]] = {
    "regression": by_regression,
    "rest": from_rest,
    "push": push,
    "switch": switch,
    "steps": step_study,
}
