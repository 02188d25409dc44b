"""A robot that is its own computer: does it learn to walk, and what does it take?

Robots and gaits are independent and run side by side on threads; nothing depends on how many.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mcmj.experiments.trunk.config import Config
from mcmj.metrics import gaits as gaitmetrics
from mcmj.metrics import orbits as metrics
from mcmj.metrics.success_rates import success_rate
from mcmj.robots import walk_metrics
from mcmj.robots.force_learning import Learned, force_learn, learn_by_regression, trial_error
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import Trunk, draw_trunk, muscle_target
from mcmj.robots.trunk_walker import TIMESTEP, TrunkWalker
from mcmj.robots.walk_metrics import Walk
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads
from mcmj.utils.validation import Array

Table = dict[str, object]
_MEASURED = (
    "distance_m", "speed_m_s", "cost_of_transport", "orbit_error", "stride_period_s",
    "duty_factors", "foot_lags",
)  # fmt: skip
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
    walk, last = gait.walk, gait.walk.after(config.walking - config.judged)
    told = {
        "taught_period_s": gait.target.period,
        "trial_errors": list(gait.learned.errors),
    }
    if fell(gait, walk):
        return {"falls": 1} | dict.fromkeys(_MEASURED) | told
    period = metrics.period_or_nan(last.outputs[0], last.sample, gait.target)
    feet = (last.contact[0] > 0).astype(np.float64)
    repeats = np.isfinite(period)
    measured = (
        walk.trunk[0, -1, 0] - walk.trunk[0, 0, 0],
        forward_speed(last),
        walk_metrics.costs_of_transport(last, GRAVITY * gait.trunk.mass)[0],
        metrics.orbit_error(last.outputs[0], gait.target),
        period,
        feet.mean(axis=0),
        gaitmetrics.phase_lags(feet, last.sample, period) if repeats else None,
    )
    return {"falls": 0} | dict(zip(_MEASURED, measured, strict=True)) | told


def forward_speed(walk: Walk) -> float:
    """Way forwards over time [m/s], negative backwards."""
    way = walk.trunk[0, -1, 0] - walk.trunk[0, 0, 0]
    return float(way / (walk.times[-1] - walk.times[0]))


def fell(gait: Gait, walk: Walk) -> bool:
    """Whether the trunk tilts by over 60 degrees, or sinks below half a leg (walkmetrics)."""
    return bool(np.isfinite(walk_metrics.fall_times(walk, gait.trunk.settings.leg)[0]))


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
    config: Config, gait: Gait, walker: TrunkWalker, duration: float, *, push: float = 0.0
) -> Table:
    """How a walk from now on ends: its last part, half of it at most."""
    try:
        walk = walker.walk(duration, push=push)
    except DivergenceError:
        return {"falls": 1, "speed_m_s": None, "orbit_error": None}
    if fell(gait, walk):
        return {"falls": 1, "speed_m_s": None, "orbit_error": None}
    last = walk.after(duration - min(config.judged, duration / 2))
    error = metrics.orbit_error(last.outputs[0], gait.target)
    return {"falls": 0, "speed_m_s": forward_speed(last), "orbit_error": error}


_PARTS: dict[str, Callable[[Config, dict[str, Gait], str, OnSteps], object]] = {
    "regression": by_regression,
    "rest": from_rest,
    "push": push,
    "switch": switch,
    "steps": step_study,
}
