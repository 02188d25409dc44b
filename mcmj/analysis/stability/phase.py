"""Phase diffusion: how sensor noise makes the rhythm wander.

White noise of standard deviation s on every length, new at each step, is fed back as W_out^T
times it: Gaussian with covariance s^2 W_out^T W_out. Along the cycle nothing brings the phase
back: to first order in s every period adds a shift of variance 2 D T, independent of the others.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mcmj.analysis.loops.loop_map import LoopMap, advance
from mcmj.analysis.stability.cycle import Cycle
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_number

BATCH = 32  # copies at a time: 16 MB of noise at 6 s
POINTS = 512  # of a cycle, among which the nearest is found


@dataclass(frozen=True)
class Diffusion:
    """Phases are times along the cycle [s].

    Attributes:
        noise: standard deviation on every length [m].
        period: T [s].
        shifts: (B,) phases that the copies gained from a period of noise, but for a constant [s].
    """

    noise: float
    period: float
    shifts: Array

    @property
    def coefficient(self) -> float:
        """D = var(shifts) / 2 T [s^2/s]."""
        return float(self.shifts.var(ddof=1)) / (2 * self.period)

    @property
    def jitter(self) -> float:
        """Standard deviation gained in a period, over the period: sqrt(2 D / T)."""
        return float(self.shifts.std(ddof=1)) / self.period

    @property
    def jitter_error(self) -> float:
        """Standard error of the jitter: of a Gaussian's deviation, jitter / sqrt(2 (B - 1))."""
        return self.jitter / float(np.sqrt(2 * (len(self.shifts) - 1)))


def fed_back_noise(
    loop: LoopMap, generator: np.random.Generator, deviations: Array, steps: int
) -> Array:
    """Offsets (B, T, n_outputs) that white noise (B,) on all signals amounts to ([m]: lengths)."""
    if loop.w_out is None:
        raise InvalidArgumentError("loop", "a readout to put noise through", None)
    weights = loop.readout.weights
    values, vectors = np.linalg.eigh(weights.T @ weights)
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    white = generator.standard_normal((len(deviations), steps, weights.shape[1]))
    found: Array = deviations[:, None, None] * (white @ root)
    return found


def phase_diffusion(
    loop: LoopMap,
    cycle: Cycle,
    noise: float,
    *,
    copies: int = 128,
    rest: int = 3,
    seed: int = 0,
) -> Diffusion:
    """Wander of the phase under sensor noise of a standard deviation [m].

    Copies run for a period with noise, each with its own, then for `rest` periods without. What
    the noise did across the cycle has then died away (by the leading multiplier to the power of
    `rest`); what is left is the shift along it, read as that of the foot on the cycle, all
    coordinates counted in units of cycle.scale.

    Raises:
        InvalidArgumentError: an argument out of bounds, or noise that throws a copy off.
    """
    require_number("noise", noise, 0.0, open_low=True)
    require_count("copies", copies, 2)
    require_count("rest", rest, 0)
    noisy = round(cycle.period / loop.timestep)
    quiet = round((1 + rest) * cycle.period / loop.timestep) - noisy
    phase_of, generator = _Phases(loop, cycle), stream(seed, "length_noise")
    shifts = []
    for first in range(0, copies, BATCH):
        deviations = np.full(min(BATCH, copies - first), noise)
        offset = fed_back_noise(loop, generator, deviations, noisy)
        run = loop.run(np.tile(cycle.state, (len(deviations), 1)), offset=offset)
        if not run.alive.all():
            raise InvalidArgumentError("noise", "an amplitude that the cycle survives", noise)
        gained = phase_of(advance(loop, run.states, quiet))
        shifts.append((gained + cycle.period / 2) % cycle.period - cycle.period / 2)
    return Diffusion(noise, cycle.period, np.concatenate(shifts))


class _Phases:
    """Phases (B,) [s] of states (B, n): the nearest of many states of the cycle, then the foot
    of the perpendicular on the tangent there."""

    def __init__(self, loop: LoopMap, cycle: Cycle) -> None:
        stride = max(1, round(cycle.period / loop.timestep / POINTS))
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
        found: Array = nearest * self._spacing + along / (tangent**2).sum(axis=1)
        return found
