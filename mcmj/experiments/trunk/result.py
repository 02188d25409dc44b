"""How the robots walk: a gait of one robot, tables over gaits and seeds."""

from dataclasses import dataclass

import numpy as np

from mcmj.experiments.trunk.config import Config
from mcmj.learning.force_learning import Learned
from mcmj.metrics import gaits as gaitmetrics
from mcmj.metrics import orbits as metrics
from mcmj.metrics.success_rates import success_rate
from mcmj.robots import walk_metrics
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import Trunk
from mcmj.robots.trunk_walker import new_robot
from mcmj.robots.walk_metrics import Walk
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target

Table = dict[str, object]

_MEASURED = (
    "distance_m", "speed_m_s", "cost_of_transport", "orbit_error", "stride_period_s",
    "duty_factors", "foot_lags",
)  # fmt: skip

TAUGHT = 0.1  # orbit error below which a gait counts as the one that was taught


@dataclass(frozen=True)
class LearnedGait:
    """One robot that has learned one gait, and its walk; the readout is None if it blew up."""

    trunk: Trunk
    target: Target
    learned: Learned | None
    walk: Walk | None

    def robot(self, timestep: float | None = None) -> Reservoir:
        """The robot in this gait, at its own or any other time step [s]."""
        assert self.learned is not None
        robot = new_robot(self.trunk)
        robot.set_readout(self.learned.w_out)
        robot.restore(self.learned.state)
        if timestep in (None, robot.timestep):
            return robot
        other = new_robot(self.trunk, timestep=timestep)
        other.set_readout(self.learned.w_out)
        other.set_state(robot.qpos, robot.qvel)
        return other


@dataclass(frozen=True)
class Result:
    """Gaits of the first robot by name, and the metrics of all."""

    config: Config
    gaits: dict[str, LearnedGait]
    metrics: Table


def walk_table(config: Config, gait: LearnedGait) -> Table:
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
    """Way along the heading over time [m/s], negative backwards."""
    return float(walk_metrics.way_ahead(walk)[0] / (walk.times[-1] - walk.times[0]))


def fell(gait: LearnedGait, walk: Walk) -> bool:
    """Whether the trunk tilts by over 60 degrees, or sinks below half a leg (walkmetrics)."""
    return bool(np.isfinite(walk_metrics.fall_times(walk, gait.trunk.settings.leg)[0]))


def seeds_table(config: Config, found: dict[tuple[int, str], LearnedGait]) -> Table:
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
