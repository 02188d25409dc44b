"""Pushed off its rhythm: when a body is back, and how far its phase is moved for good.

A push at every moment of the stride, beside the same walk without it. A body that does not feel
the legs is never moved: its outputs keep the same bits.
"""

import numpy as np
from scipy.spatial import cKDTree

from mcmj.experiments.walk.lesson import Table, WalkLesson, states_at
from mcmj.metrics.orbits import rms_radius
from mcmj.robots import walk_metrics
from mcmj.robots.walk_metrics import Walk
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

TOLERANCE = 0.03  # distance from the orbit, over its RMS radius
STRIDES = 4  # at the end, by which phases are compared
DIRECTIONS = {"forwards": (1.0, 0.0), "sideways": (0.0, 1.0)}


def recover(lesson: WalkLesson, name: str, on_steps: OnSteps = lambda steps: None) -> Table:
    """Pushes on one gait, by direction, without coupling and with it; lists are over `moments`.

    wander is how far an unpushed walk comes from its own orbit: below that there is no recovery.
    """
    config = lesson.config
    moments = np.arange(config.moments) / config.moments
    return {"moments": moments} | {
        label: _pushed(lesson, name, coupling, moments * lesson.period(name), on_steps)
        for label, coupling in lesson.couplings.items()
    }


def _pushed(
    lesson: WalkLesson, name: str, coupling: float, waits: Array, on_steps: OnSteps
) -> Table:
    config, gait, n = lesson.config, lesson.gait(name, coupling), len(waits)
    pushes = config.nudge * np.array([(0.0, 0.0), *DIRECTIONS.values()])
    walker = lesson.walker(coupling=coupling, copies=n * len(pushes))
    walker.start(gait)
    walker.restore(np.tile(states_at(lesson, gait, waits, coupling), (len(pushes), 1)))
    walk = walker.walk(config.after, push=np.repeat(pushes, n, axis=0))  # the unpushed ones first
    on_steps(len(walk.trunk) * round(config.after / walker.timestep))
    upright = np.isinf(walk_metrics.fall_times(walk, config.robot.leg)).reshape(-1, n)
    table: Table = {"wander": max(_wander(walk.outputs[twin]) for twin in range(n))}
    for index, direction in enumerate(DIRECTIONS, start=1):
        rows = [
            _compared(walk, index * n + twin, twin, lesson.period(name))
            if upright[[0, index], twin].all()
            else dict.fromkeys(("deviation", "recovery_s", "phase_shift"), np.nan)
            for twin in range(n)
        ]
        answers = {key: np.array([row[key] for row in rows]) for key in rows[0]}
        table[direction] = {"falls": int((~upright[index]).sum()), **answers}
    return table


def _compared(walk: Walk, copy: int, twin: int, guess: float) -> dict[str, float]:
    """A pushed copy beside its twin.

    deviation: largest distance from the twin's orbit, over its RMS radius; recovery_s: after
    which it stays below TOLERANCE; phase_shift: how far ahead it is at the end, in periods.
    """
    away = distances_from(walk.outputs[twin], walk.outputs[copy])
    end = walk.after(walk.times[-1] - STRIDES * guess)
    period = walk_metrics.stride_period(end, guess, twin)
    shift = walk_metrics.phase_shift(end, period, copy, twin) if np.isfinite(period) else np.nan
    return {
        "deviation": float(away.max()),
        "recovery_s": recovery(away, walk.sample),
        "phase_shift": shift,
    }


def _wander(outputs: Array) -> float:
    """Largest distance of the second half of outputs (T, n) from the orbit of the first."""
    half = len(outputs) // 2
    return float(distances_from(outputs[:half], outputs[half:]).max())


def distances_from(reference: Array, outputs: Array) -> Array:
    """Of outputs (T, n) from an orbit through samples (M, n), over its RMS radius."""
    found: Array = cKDTree(reference).query(outputs)[0] / rms_radius(reference)
    return found


def recovery(away: Array, sample: float) -> float:
    """Time [s] from which distances (T,) stay below TOLERANCE; infinite if they end above it."""
    outside = np.flatnonzero(away > TOLERANCE)
    last = int(outside[-1]) + 1 if outside.size else 0
    return np.inf if last == len(away) else last * sample
