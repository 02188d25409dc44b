"""Largest Lyapunov exponent: two trajectories, renormalised (Benettin et al. 1980).

    lambda = lim (1 / t) sum_i ln(|d_i| / d_0)

d_i is the distance that has grown from d_0 over the i-th interval; the second trajectory is
then moved back along the line between both. 0 on a stable limit cycle (a shift along it
stays), the largest real part at a fixed point, positive in chaos.
"""

from dataclasses import dataclass

import numpy as np

from mcmj.analysis.loops.loop_map import LoopMap, advance
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_number

PAIRS = 4  # trajectories started in random directions
DISTANCE = 1e-6  # d_0, in units of the scale: far above rounding, far below curvature


@dataclass(frozen=True)
class Exponent:
    """An estimate and how far it has converged.

    Attributes:
        value: mean over the pairs [1/s].
        spread: standard deviation over the pairs, of different first directions [1/s].
        times: (K,) end of each interval [s].
        running: (K,) the estimate so far [1/s].
    """

    value: float
    spread: float
    times: Array
    running: Array


def lyapunov_exponent(
    loop: LoopMap,
    state: Array,
    *,
    interval: float,
    intervals: int = 40,
    transient: int = 5,
    scale: object = 1.0,
    seed: int = 0,
) -> Exponent:
    """Largest exponent along the trajectory through a state (n,).

    Args:
        interval: between renormalisations [s]; on a cycle its period, so that stretching
            within it cancels.
        intervals: that count.
        transient: intervals before them, for the direction to turn to the fastest.
        scale: (n,) or a number, the units of the coordinates.
        seed: of the PAIRS first directions.

    Raises:
        DivergenceError: a trajectory blew up.
        InvalidArgumentError: an argument out of bounds.
    """
    require_number("interval", interval, loop.timestep)
    for name, count, low in (("intervals", intervals, 1), ("transient", transient, 0)):
        require_count(name, count, low)
    units = np.broadcast_to(np.asarray(scale, dtype=np.float64), (loop.size,))
    steps = max(1, round(interval / loop.timestep))
    apart = stream(seed, "initial_state").standard_normal((PAIRS, loop.size))
    growth = np.empty((transient + intervals, PAIRS))
    here = np.asarray(state, dtype=np.float64)
    for i in range(transient + intervals):
        apart *= DISTANCE / np.linalg.norm(apart, axis=1, keepdims=True)
        ends = advance(loop, np.vstack([here, here + apart * units]), steps)
        here, apart = ends[0], (ends[1:] - ends[0]) / units
        growth[i] = np.log(np.linalg.norm(apart, axis=1) / DISTANCE)
    rates = growth[transient:] / (steps * loop.timestep)
    times = steps * loop.timestep * np.arange(1, intervals + 1, dtype=np.float64)
    running: Array = np.cumsum(rates.mean(axis=1), dtype=np.float64) / np.arange(
        1, intervals + 1, dtype=np.float64
    )
    each = rates.mean(axis=0)
    return Exponent(float(each.mean()), float(each.std()), times, running)
