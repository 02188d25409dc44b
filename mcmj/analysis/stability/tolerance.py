"""Tolerances: the largest disturbance that a copy recovers from, by bisection; then over copies."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mcmj.analysis.loops.loop_map import LoopMap
from mcmj.analysis.stability.basin import pushed, survey
from mcmj.analysis.stability.phase import fed_back_noise
from mcmj.targets.limit_cycles import Target
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_number

RATIO = 1.1  # bounds as close as that end a bisection
FORCES = 0.1, 1e4  # where to look [N]
NOISES = 1e-5, 1e2  # [m]


@dataclass(frozen=True)
class Trial:
    """A disturbance, and what is a recovery from it.

    Attributes:
        hold: how long it acts [s].
        recovery: time to come back [s].
        threshold: largest orbit error of a recovery.
        ratio: of the bounds between which an amplitude is known, at the end of a search.
    """

    hold: float = 10.0
    recovery: float = 40.0
    threshold: float = 0.05
    ratio: float = RATIO


@dataclass(frozen=True)
class Tolerance:
    """What copies at different phases, each with a disturbance of its own, recover from.

    Attributes:
        values: (B,) of each copy: the largest amplitude tried that it recovered from; 0 if it
            did not even from the least, `high` if it did from the largest.
    """

    values: Array

    @property
    def median(self) -> float:
        """Half of the copies recover from so much."""
        return float(np.median(self.values))

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the median, whatever the distribution; 0 to infinity below 6 copies.

        Between order statistics: the number of copies below the true median is binomial (Conover,
        Practical Nonparametric Statistics, section 3.2).
        """
        from scipy.stats import binom  # takes a second to import

        count = len(self.values)
        rank = int(binom.ppf(0.025, count, 0.5))
        if rank == 0:
            return 0.0, np.inf
        ordered = np.sort(self.values)
        return float(ordered[rank - 1]), float(ordered[count - rank])

    @property
    def least(self) -> float:
        """Of the weakest copy: the more copies, the smaller."""
        return float(self.values.min())


def largest_tolerated(
    recovers: Callable[[Array], npt.NDArray[np.bool_]],
    copies: int,
    low: float,
    high: float,
    *,
    ratio: float = RATIO,
) -> Tolerance:
    """Bisect each copy's amplitude on a logarithmic scale, taking its recovery to be monotone.

    Args:
        recovers: amplitudes (B,), one a copy -> whether each recovers from its own.
        low, high: where to look.
        ratio: stop when the bounds are as close as that.

    Raises:
        InvalidArgumentError: an argument out of bounds.
    """
    require_number("low", low, 0.0, high, open_low=True)
    require_number("ratio", ratio, 1.0, open_low=True)
    good, bad = np.full(copies, low), np.full(copies, high)
    at_low, at_high = recovers(good), recovers(bad)
    while bad[0] / good[0] > ratio:  # as close for all copies
        middle = np.sqrt(good * bad)
        held = recovers(middle)
        good, bad = np.where(held, middle, good), np.where(held, bad, middle)
    return Tolerance(np.where(at_high, high, np.where(at_low, good, 0.0)))


def force_tolerance(
    loop: LoopMap,
    target: Target,
    states: Array,
    trial: Trial,
    *,
    refine: int = 1,
    seed: int = 0,
) -> Tolerance:
    """Constant random forces in [-F, F] on a body's nodes (as in Fig. 6b) or joints: largest F.

    Every copy (B, n) has its own pattern, the same at every F.

    Args:
        refine: smaller steps while the forces act; see `basin.pushed`.
    """
    generator = stream(seed, "forces")
    pattern = generator.uniform(-1.0, 1.0, (len(states), loop.n_forces))

    def recovers(amplitudes: Array) -> npt.NDArray[np.bool_]:
        after = pushed(loop, states, amplitudes[:, None] * pattern, trial.hold, refine=refine)
        return _recovered(loop, target, after, trial)

    return largest_tolerated(recovers, len(states), *FORCES, ratio=trial.ratio)


def noise_tolerance(
    loop: LoopMap,
    target: Target,
    states: Array,
    trial: Trial,
    *,
    seed: int = 0,
) -> Tolerance:
    """White noise on all signals for a while (Fig. 6e): largest standard deviation, [m] of lengths.

    Every copy (B, n) has its own noise, the same but for its size at every level. Arguments as
    for `force_tolerance`.
    """
    steps = round(trial.hold / loop.timestep)
    unit = fed_back_noise(loop, stream(seed, "length_noise"), np.ones(len(states)), steps)

    def recovers(amplitudes: Array) -> npt.NDArray[np.bool_]:
        run = loop.run(states, offset=amplitudes[:, None, None] * unit)
        after = np.where(run.alive[:, None], run.states, np.nan)
        return _recovered(loop, target, after, trial)

    return largest_tolerated(recovers, len(states), *NOISES, ratio=trial.ratio)


def _recovered(loop: LoopMap, target: Target, states: Array, trial: Trial) -> npt.NDArray[np.bool_]:
    found = survey(loop, target, states, duration=trial.recovery, threshold=trial.threshold)
    return found.recovered
