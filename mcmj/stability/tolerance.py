"""Tolerances: the largest disturbance after which a body still recovers, by bisection."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mcmj.stability.basin import pushed, survey
from mcmj.stability.loop import ClosedLoop
from mcmj.stability.phase import fed_back_noise
from mcmj.streams import stream
from mcmj.targets import Target
from mcmj.validation import Array, require_number


@dataclass(frozen=True)
class Tolerance:
    """Result of a bisection.

    Attributes:
        value: largest amplitude tried that was recovered from, with none tried below it that
            was not; 0 if even the least was not, `high` if every one was.
        failed: least amplitude tried that was not recovered from; infinite if every one was.
        tried: amplitude -> fraction of the copies that recovered.
    """

    value: float
    failed: float
    tried: dict[float, float]


def largest_tolerated(
    fraction: Callable[[float], float],
    low: float,
    high: float,
    *,
    ratio: float = 1.1,
    needed: float = 1.0,
) -> Tolerance:
    """Bisect an amplitude on a logarithmic scale, taking recovery to be monotone in it.

    Args:
        fraction: of the copies that recover from an amplitude.
        low, high: where to look.
        ratio: stop when the bounds are as close as that.
        needed: fraction that counts as recovered.

    Raises:
        InvalidArgumentError: an argument out of bounds.
    """
    require_number("low", low, 0.0, high, open_low=True)
    require_number("ratio", ratio, 1.0, open_low=True)
    tried: dict[float, float] = {}

    def good(amplitude: float) -> bool:
        tried[amplitude] = fraction(amplitude)
        return tried[amplitude] >= needed

    if not good(low):
        return Tolerance(0.0, low, tried)
    if good(high):
        return Tolerance(high, np.inf, tried)
    while high / low > ratio:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if good(middle) else (low, middle)
    return Tolerance(low, high, tried)


def force_tolerance(
    loop: ClosedLoop,
    target: Target,
    states: Array,
    *,
    low: float = 0.1,
    high: float = 1e4,
    hold: float = 10.0,
    recovery: float = 40.0,
    threshold: float = 0.05,
    ratio: float = 1.1,
    refine: int = 1,
    seed: int = 0,
) -> Tolerance:
    """Constant random horizontal forces in [-F, F] on all nodes (as in Fig. 6b): largest F [N].

    Every copy (B, n) has its own pattern, the same at every F; all must recover.

    Args:
        hold: how long the forces act [s].
        recovery: time to come back [s].
        refine: smaller steps while the forces act; see `basin.pushed`.
    """
    generator = stream(seed, "forces")
    pattern = generator.uniform(-1.0, 1.0, (len(states), loop.body.n_nodes))

    def fraction(amplitude: float) -> float:
        after = pushed(loop, states, amplitude * pattern, hold, refine=refine)
        return survey(loop, target, after, duration=recovery, threshold=threshold).fraction

    return largest_tolerated(fraction, low, high, ratio=ratio)


def noise_tolerance(
    loop: ClosedLoop,
    target: Target,
    states: Array,
    *,
    low: float = 1e-5,
    high: float = 1e2,
    hold: float = 10.0,
    recovery: float = 40.0,
    threshold: float = 0.05,
    ratio: float = 1.1,
    seed: int = 0,
) -> Tolerance:
    """White noise on all lengths for a while (Fig. 6e): largest standard deviation [m].

    Every copy (B, n) has its own noise, the same but for its size at every level; all must
    recover. Arguments as for `force_tolerance`.
    """
    steps = round(hold / loop.timestep)
    unit = fed_back_noise(loop, stream(seed, "length_noise"), np.ones(len(states)), steps)

    def fraction(amplitude: float) -> float:
        run = loop.run(states, offset=amplitude * unit)
        after = np.where(run.alive[:, None], run.states, np.nan)
        return survey(loop, target, after, duration=recovery, threshold=threshold).fraction

    return largest_tolerated(fraction, low, high, ratio=ratio)
