"""Phase diffusion: how sensor noise makes the rhythm wander.

White noise of standard deviation s on every length, new at each step, is fed back as W_out^T
times it: Gaussian with covariance s^2 W_out^T W_out. Along the cycle nothing brings the phase
back, so its variance grows as 2 D t.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mcmj.errors import InvalidArgumentError
from mcmj.stability.cycle import Cycle
from mcmj.stability.loop import ClosedLoop
from mcmj.streams import stream
from mcmj.validation import Array, require_count, require_number


@dataclass(frozen=True)
class Diffusion:
    """Phases are times along the cycle [s].

    Attributes:
        noise: standard deviation on every length [m].
        coefficient: D [s^2/s], half the slope of the variance, by least squares.
        jitter: standard deviation gained in a period, over the period: sqrt(2 D / T).
        times: (K,) [s].
        variance: (K,) of the phases over the copies [s^2].
    """

    noise: float
    coefficient: float
    jitter: float
    times: Array
    variance: Array


def fed_back_noise(
    loop: ClosedLoop, generator: np.random.Generator, deviations: Array, steps: int
) -> Array:
    """Offsets (B, T, n_outputs) that white noise (B,) [m] on all lengths amounts to."""
    if loop.w_out is None:
        raise InvalidArgumentError("loop", "a readout to put noise through", None)
    weights = loop.w_out[: loop.body.n_springs]
    values, vectors = np.linalg.eigh(weights.T @ weights)
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    white = generator.standard_normal((len(deviations), steps, weights.shape[1]))
    return deviations[:, None, None] * (white @ root)


def phase_diffusion(
    loop: ClosedLoop,
    cycle: Cycle,
    noise: float,
    *,
    copies: int = 32,
    periods: int = 12,
    seed: int = 0,
) -> Diffusion:
    """Wander of the phase under sensor noise of a standard deviation [m].

    The phase of a state is that of its foot on the cycle, all coordinates counted in units of
    cycle.scale; it is read once a period.

    Raises:
        InvalidArgumentError: an argument out of bounds, or noise that throws a copy off.
    """
    require_number("noise", noise, 0.0, open_low=True)
    require_count("copies", copies, 2)
    require_count("periods", periods, 3)
    steps = round(cycle.period / loop.timestep)
    phase_of = _Phases(loop, cycle)
    generator = stream(seed, "length_noise")
    states = np.tile(cycle.state, (copies, 1))
    phases = np.empty((periods, copies))
    total = 0.0
    for k in range(periods):
        run = loop.run(
            states, offset=fed_back_noise(loop, generator, np.full(copies, noise), steps)
        )
        if not run.alive.all():
            raise InvalidArgumentError("noise", "an amplitude that the cycle survives", noise)
        states = run.states
        total += steps * loop.timestep
        before = phases[k - 1] if k else np.zeros(copies)
        gained = phase_of(states) - total - before
        phases[k] = before + (gained + cycle.period / 2) % cycle.period - cycle.period / 2
    times = cycle.period * np.arange(1, periods + 1, dtype=np.float64)
    variance: Array = phases.var(axis=1, ddof=1, dtype=np.float64)
    slope = float(np.polyfit(times, variance, 1)[0])
    coefficient = max(slope, 0.0) / 2
    jitter = float(np.sqrt(2 * coefficient / cycle.period))
    return Diffusion(noise, coefficient, jitter, times, variance)


class _Phases:
    """Phases (B,) [s] of states (B, n): the nearest of many states of the cycle, then the foot
    of the perpendicular on the tangent there."""

    def __init__(self, loop: ClosedLoop, cycle: Cycle, points: int = 512) -> None:
        stride = max(1, round(cycle.period / loop.timestep / points))
        count = int(cycle.period / loop.timestep / stride)
        self._scale, self._spacing = cycle.scale, stride * loop.timestep
        trail = loop.trail(cycle.state, stride, count + 2) / cycle.scale
        self._points = trail[:-1]
        self._tangents = np.gradient(trail, self._spacing, axis=0)[:-1]
        self._tree = cKDTree(self._points)

    def __call__(self, states: Array) -> Array:
        scaled = states / self._scale
        nearest = self._tree.query(scaled)[1]
        tangent = self._tangents[nearest]
        along = ((scaled - self._points[nearest]) * tangent).sum(axis=1)
        return nearest * self._spacing + along / (tangent**2).sum(axis=1)
