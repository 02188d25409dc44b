"""The largest stable step along a motion that is known, as a bracket of a factor of two.

At every moment the springs have a stiffness, a damping and a place; T(t) is the limit of small
errors on top of the motion, linearised there (`linearisation`, with tangents). A step h above T
makes errors grow, and what that comes to depends on how long it lasts:

    P = largest h up to which no stretch of time with T(t) < h lasts longer than g h
    stable: about P .. 2 P

A motion that goes on (forces, a limit cycle) has P = min T: up to about 1.4 P, in one hard case
2 P, it survives as an oscillation from step to step that cubic dampers bound.

A kick is over at once. A mass m on a cubic damper alone, q = d3 v^3, kicked to v0, has
T(t) = T(0) (1 + 2 d3 v0^2 t / m), and blows up at h d3 v0^2 / m = 2.00 (Euler), 2.39 (RK4) and
2.16 (leapfrog), which is 3.0, 2.6 and 6.5 T(0). The leapfrog bears most for its limit: its first
step has half a kick, and its dampers see twice the velocity of an oscillation q_k = (-1)^k u only
once there is one. The shares g of a step
(Integrator.grace) put these three at 1.5 to 1.8 P (tests/simulation/test_along_motion.py).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.core.integrators import INTEGRATORS, integrator_named
from mcmj.simulation.stepsize.eigenvalues import limit_of
from mcmj.simulation.stepsize.linearisation import Motion, linear_system
from mcmj.utils.validation import Array

LOW, HIGH = 0.83, 1.66  # of P: ends of the bracket, which holds what the hard cases show
FINER = 8  # points between two samples, where a stretch may begin or end
RATIO = 1.01  # of two steps that are tried
LONGEST = 1e3  # s: a longer step is any


@dataclass(frozen=True)
class KnownMotion:
    """Samples of a motion.

    Attributes:
        times: (T,) [s], rising.
        positions, velocities: (T, N, D) [m], [m/s].
    """

    times: Array
    positions: Array
    velocities: Array

    def rates(self, body: Body) -> Array:
        """dl/dt of each spring (T, L) [m/s]."""
        tail, head = body.springs.T
        gap = self.positions[:, head] - self.positions[:, tail]
        moved = self.velocities[:, head] - self.velocities[:, tail]
        lengths = np.maximum(np.linalg.norm(gap, axis=-1), np.finfo(float).tiny)
        return np.asarray((gap * moved).sum(axis=-1) / lengths)

    def thinned(self, samples: int) -> "KnownMotion":
        """At most so many samples: half of them the first ones, where kicks die away."""
        total = len(self.times)
        first, rest = np.arange(min(samples // 2, total)), np.linspace(0, total - 1, samples // 2)
        kept = np.union1d(first, rest.astype(int))
        return KnownMotion(self.times[kept], self.positions[kept], self.velocities[kept])


def step_bracket(
    body: Body, integrator: str, motion: KnownMotion, *, w_out: object = None
) -> tuple[float, float]:
    """The largest stable step [s] lies between these two; infinity if every step is stable.

    For explicit integrators. Of implicit ones it is no more than the linearised limit, which
    the hard cases miss by factors up to 300 (docs/experiments/hard_cases.md).

    Args:
        integrator: a name of mcmj.core.integrators.
        w_out: readout, if the loop is closed.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    row = integrator_named(integrator, INTEGRATORS)
    limits = limits_along(body, integrator, motion, w_out=w_out)
    middle = lasting_limit(motion.times, limits, row.grace)
    return LOW * middle, HIGH * middle


def limits_along(
    body: Body, integrator: str, motion: KnownMotion, *, w_out: object = None
) -> Array:
    """T (T,) [s] at the samples of a motion."""
    limits = []
    for where, rates in zip(motion.positions, np.abs(motion.rates(body)), strict=True):
        system = linear_system(body, where, motion=Motion(speed=rates), w_out=w_out)
        limits.append(limit_of(system, integrator))
    return np.array(limits)


def lasting_limit(times: Array, limits: Array, grace: float) -> float:
    """Largest h up to which no stretch with limits < h lasts longer than `grace` h.

    Between the samples log T is taken as linear; what goes on at the end lasts for ever.
    """
    finite = np.minimum(limits, 10 * LONGEST)
    samples = np.arange(len(times))
    finer = np.linspace(0, len(times) - 1, FINER * (len(times) - 1) + 1)
    moments = np.interp(finer, samples, times)
    levels = np.exp(np.interp(moments, times, np.log(finite)))
    step = float(levels.min())
    while step < LONGEST and _longest(moments, levels < RATIO * step) <= grace * RATIO * step:
        step *= RATIO
    return step if step < LONGEST else float("inf")


def _longest(moments: Array, bad: npt.NDArray[np.bool_]) -> float:
    """Duration [s] of the longest stretch of moments that are bad; infinite if at the end."""
    if bad[-1]:
        return float("inf")
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]  # the moment after the last bad one
    return float((moments[ends] - moments[starts]).max(initial=0.0))
