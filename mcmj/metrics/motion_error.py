"""How far a motion is from a target's, place and pace together, at one moment; for rewards."""

import numpy as np

from mcmj.metrics.orbits import rms_radius
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

POINTS = 2048  # of the target's orbit
SLOWEST = 0.1  # of the rms speed: where a target is slower, the pace is judged by this speed


class MotionError:
    """Distance of outputs y and their velocity v to the nearest point of a target's motion.

        e^2 = min over theta of |y - y*(theta)|^2 / R^2 + |v - v*(theta)|^2 / s(theta)^2
        s(theta) = max(|v*(theta)|, V / 10)

    R is the orbit's rms radius, V the rms of |v*|, and velocities are differences over one
    interval, v_k = (y_k - y_(k-1)) / interval, v*(theta) the same of the target. When does not
    count, only where and how fast: e = |p - 1| on the orbit at p times the pace, so 1 for outputs
    that stand still on it, and 2 for those that go backwards.

    Args:
        target: the motion.
        interval: between samples [s].

    Raises:
        InvalidArgumentError: fewer than 8 samples a period, or a target that does not move.
    """

    def __init__(self, target: Target, interval: float) -> None:
        if not interval <= target.period / 8:
            raise InvalidArgumentError("interval", f"at most {target.period / 8:.3g} s", interval)
        times = target.period * (1.0 + np.arange(POINTS) / POINTS)
        self._interval, self._orbit = interval, target.sample(times)
        self._velocity = (self._orbit - target.sample(times - interval)) / interval
        squares = (self._velocity**2).sum(axis=1)
        if not squares.any():
            raise InvalidArgumentError("target", "one that moves", target.name)
        self._place = 1.0 / rms_radius(self._orbit) ** 2
        self._pace = 1.0 / np.maximum(squares, SLOWEST**2 * squares.mean())

    def of(self, outputs: Array, before: Array) -> float:
        """The error e of outputs (n_outputs,), from those one interval before."""
        velocity = (outputs - before) / self._interval
        place = ((outputs - self._orbit) ** 2).sum(axis=1)
        pace = ((velocity - self._velocity) ** 2).sum(axis=1)
        return float(np.sqrt((self._place * place + self._pace * pace).min()))
