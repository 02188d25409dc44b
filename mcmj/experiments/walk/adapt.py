"""The ground as part of the computer: does the rhythm adapt to it if the legs' loads enter?

Every ground is walked on from several moments of the stride, by the body that does not feel it
(no coupling) and by the one that was taught with it (mcmj.robots.ground_training).
"""

import numpy as np

from mcmj.experiments.walk.lesson import Table, WalkLesson, walker_at
from mcmj.robots import walk_metrics
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import Terrain
from mcmj.targets.gaits import LEGS
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array


def adapt(lesson: WalkLesson, name: str, on_steps: OnSteps = lambda steps: None) -> Table:
    """One gait on slopes [degrees] and with loads [kg], without coupling and with it."""
    return {
        label: _response(lesson, name, coupling, on_steps)
        for label, coupling in lesson.couplings.items()
    }


def _response(lesson: WalkLesson, name: str, coupling: float, on_steps: OnSteps) -> Table:
    config, gait = lesson.config, lesson.gait(name, coupling)
    waits = lesson.period(name) * np.arange(config.starts) / config.starts
    motions = np.array([each.motion for each in walker_at(lesson, gait, waits, coupling)])

    def on(terrain: Terrain) -> Table:
        walker = lesson.walker(terrain=terrain, coupling=coupling, copies=config.starts)
        walker.start(gait, motions)
        walk = walker.walk(config.before + config.after)
        on_steps(config.starts * round((config.before + config.after) / walker.timestep))
        return _row(lesson, name, terrain, walk)

    level = on(Terrain())
    slopes = {f"{slope:g}": on(Terrain(slope=np.radians(slope))) for slope in config.slopes}
    loads = {f"{load:g}": on(Terrain(load=load)) for load in config.loads}
    return {"slope": _sorted(slopes | {"0": level}), "load": _sorted(loads | {"0": level})}


def _row(lesson: WalkLesson, name: str, terrain: Terrain, walk: Walk) -> Table:
    """Falls, and the spread over the copies that did not.

    ground_lag is that of the feet's load behind the outputs, mean of all legs [strides].
    """
    falls = np.isfinite(walk_metrics.fall_times(walk, lesson.config.robot.leg, terrain.slope))
    upright = np.flatnonzero(~falls).tolist()
    settled = walk.after(lesson.config.before)
    guess = lesson.period(name)
    periods = [walk_metrics.stride_period(settled, guess, copy) for copy in upright]
    lags = [
        walk_metrics.ground_lags(settled, period, copy)
        for copy, period in zip(upright, periods, strict=True)
        if np.isfinite(period)
    ]
    weight = GRAVITY * (lesson.config.robot.mass + terrain.load)
    costs = walk_metrics.costs_of_transport(settled, weight)
    return {
        "falls": int(falls.sum()),
        "of": len(falls),
        "stride_period_s": spread(np.array(periods)),
        "ground_lag": spread(_about(lags).mean(axis=1)),
        "speed_m_s": spread(walk_metrics.speeds(settled)[upright]),
        "cost_of_transport": spread(costs[upright]),
    }


def spread(values: Array) -> Table:
    """Median and range of values (n,), without what is not finite; NaN if nothing is."""
    kept = values[np.isfinite(values)]
    if len(kept) == 0:
        return dict.fromkeys(("median", "low", "high"), np.nan)
    return {"median": np.median(kept), "low": kept.min(), "high": kept.max()}


def _about(lags: list[Array]) -> Array:
    """Lags (copies, n_legs) on a circle as numbers within half a turn of the first's."""
    turns = np.array(lags).reshape(-1, len(LEGS))
    return turns[:1] + np.mod(turns - turns[:1] + 0.5, 1.0) - 0.5


def _sorted(rows: dict[str, Table]) -> dict[str, Table]:
    return dict(sorted(rows.items(), key=lambda item: float(item[0])))
