"""How the soft robots walk: rows and tables."""

from dataclasses import dataclass

import numpy as np

from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.soft_robot.steer import SteeredRobot
from mcmj.experiments.trunk.result import LearnedGait, Table, fell
from mcmj.metrics import orbits
from mcmj.robots import walk_metrics
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.walk_metrics import Walk

MEASURED = (
    "speed_m_s", "orbit_error", "cost_of_transport", "positive_cost", "turn_deg_s", "period_ratio",
)  # fmt: skip


@dataclass(frozen=True)
class Result:
    """Gaits of the first robot by name, its steered likes, and the metrics of all."""

    config: Config
    gaits: dict[str, LearnedGait]
    steered: dict[str, SteeredRobot]
    metrics: Table


def measures(gait: LearnedGait, walk: Walk) -> Table:
    """Of a stretch of a walk: speed ahead, along the heading; costs over weight times way."""
    duration = float(walk.times[-1] - walk.times[0])
    way = float(walk_metrics.way_ahead(walk)[0])
    work = [walk.sample * power[0, 1:].sum() for power in (walk.net, walk.power)]
    costs = np.array(work) / (GRAVITY * gait.trunk.mass * max(abs(way), 1e-9))
    period = orbits.period_or_nan(walk.outputs[0], walk.sample, gait.target)
    values = (
        way / duration,
        orbits.orbit_error(walk.outputs[0], gait.target),
        *costs,
        float(np.degrees(walk_metrics.turns(walk)[0])) / duration,
        period / gait.target.period,
    )
    return dict(zip(MEASURED, values, strict=True))


def walk_row(config: Config, gait: LearnedGait) -> Table:
    """How the walk after learning went; what a robot that fell did not do is None."""
    if gait.walk is None or gait.learned is None:
        return {"upright": 0} | dict.fromkeys(MEASURED)
    errors = {"trial_errors": list(gait.learned.errors)}
    if fell(gait, gait.walk):
        return {"upright": 0} | dict.fromkeys(MEASURED) | errors
    last = gait.walk.after(config.walking - config.judged)
    return {"upright": 1} | measures(gait, last) | errors


def gait_table(config: Config, gaits: list[LearnedGait]) -> Table:
    """Over robots: how many are upright, medians of those (of the turning's size), all rows."""
    rows = [walk_row(config, gait) for gait in gaits]
    upright = [row for row in rows if row["upright"]]
    table: Table = {"upright": len(upright), "of": len(rows)}
    for name in MEASURED:
        values = np.array([row[name] for row in upright], dtype=np.float64)
        values = np.abs(values) if name == "turn_deg_s" else values
        table[name] = float(np.median(values)) if len(values) else None
    return table | {"robots": rows}
