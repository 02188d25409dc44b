"""The ground as part of the computer: does the rhythm adapt if the legs' loads enter the body?"""

import numpy as np
from scipy.spatial import cKDTree

from mcmj import walkmetrics
from mcmj.experiments.walk_lesson import Lesson, Table, walk_table
from mcmj.metrics import rms_radius
from mcmj.progress import OnSteps
from mcmj.validation import Array
from mcmj.walker import Terrain

TOLERANCE = 0.1  # distance from the orbit, over its RMS radius, at which a rhythm is back


def adapt(lesson: Lesson, name: str, on_steps: OnSteps = lambda steps: None) -> Table:
    """One gait on every ground and after a push, without coupling and with it."""
    config = lesson.config
    slope = np.radians(config.slope)
    terrains = {
        "flat": Terrain(),
        "uphill": Terrain(slope=slope),
        "downhill": Terrain(slope=-slope),
        "load": Terrain(load=config.load),
    }
    table: Table = {}
    for label, coupling in (("uncoupled", 0.0), ("coupled", config.coupling)):
        rows: Table = {}
        for place, terrain in terrains.items():
            rows[place] = _on(lesson, name, terrain, coupling)
        rows["push"] = nudged(lesson, name, coupling)
        table[label] = rows
        duration = config.settle + config.walking
        on_steps(round((len(terrains) + 1) * duration * config.pace / config.timestep))
    return table


def _on(lesson: Lesson, name: str, terrain: Terrain, coupling: float) -> Table:
    config = lesson.config
    walker = lesson.walker(terrain=terrain, coupling=coupling)
    walker.start(lesson.gaits[name])
    walk = walker.walk(config.settle + config.walking)
    row = walk_table(lesson, name, walk, slope=terrain.slope, mass=walker.mass)
    period = row["stride_period_s"]
    assert isinstance(period, float)
    steady = np.isfinite(period)
    lags = walkmetrics.ground_lags(walk.after(config.settle), period) if steady else np.nan
    return row | {"ground_lags": lags}


def nudged(lesson: Lesson, name: str, coupling: float) -> Table:
    """What a push sideways does to the rhythm, beside the same walk without it.

    recovery_s is when outputs are within 10 % of the other's orbit for good (0: they were never
    further), phase_shift by how much, in periods, the pushed one is then ahead; neither is known
    (NaN) if one of the two falls.
    """
    config = lesson.config
    walker = lesson.walker(coupling=coupling, copies=2)
    walker.start(lesson.gaits[name])
    walker.advance(round(config.settle / walker.timestep))
    walk = walker.walk(config.walking, push=[[0.0, 0.0], [0.0, config.nudge]])
    fallen = np.isfinite(walkmetrics.fall_times(walk, config.robot.leg))
    upright = not fallen.any()
    period = walkmetrics.stride_period(walk.after(config.walking / 2), lesson.period(name))
    steady = upright and np.isfinite(period)
    return {
        "falls": int(fallen[1]),
        "recovery_s": (
            recovery(walk.outputs[1], walk.outputs[0], walk.sample) if upright else np.nan
        ),
        "phase_shift": walkmetrics.phase_shift(walk, period, 1) if steady else np.nan,
    }


def recovery(outputs: Array, reference: Array, sample: float) -> float:
    """Time [s] from which outputs (T, n) stay near an orbit through samples (M, n)."""
    away = cKDTree(reference).query(outputs)[0] / rms_radius(reference)
    outside = np.flatnonzero(away > TOLERANCE)
    last = int(outside[-1]) + 1 if outside.size else 0
    return np.inf if last == len(outputs) else last * sample
