"""How legs step: stance, duty factors and phase lags of outputs, one a leg, LF first."""

import functools

import numpy as np
import numpy.typing as npt

from mcmj.metrics import orbits
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_number

STILL = 1e-6  # a leg's fundamental below this share of the largest has no phase


def in_stance(outputs: Array) -> npt.NDArray[np.bool_]:
    """Whether each leg is in stance (T, n): where its output (T, n) falls, by central differences.

    The oscillators of targets.gaits are in stance where y_i > 0, which outputs do not show; but
    there x_i' is near -omega_i y_i, so x_i falls.
    """
    values = as_array("outputs", outputs, (None, None))
    return np.gradient(values, axis=0) < 0


def duty_factors(outputs: Array, timestep: float, period: float) -> Array:
    """Share of the time (n,) in which each leg is in stance, over whole periods at the end.

    Args:
        outputs: (T, n), one period at least.
        period: of the outputs [s].

    Raises:
        InvalidArgumentError: less than a period.
    """
    found: Array = in_stance(outputs)[-_whole_periods(outputs, timestep, period) :].mean(axis=0)
    return found


def phase_lags(outputs: Array, timestep: float, period: float) -> Array:
    """Phase lags (n,) behind the first leg, in periods from 0 to 1: those of the fundamentals.

    With c_i the Fourier coefficient of output i at frequency 1 / period, over whole periods at
    the end, the lag is (arg c_1 - arg c_i) / 2 pi: for legs that all do the same, one later
    than the other, exactly the delay over the period. NaN for a leg that stands still, and for
    all if the first does.

    Args:
        outputs: (T, n), one period at least.
        period: of the outputs [s].

    Raises:
        InvalidArgumentError: less than a period.
    """
    last = as_array("outputs", outputs, (None, None))
    last = last[-_whole_periods(last, timestep, period) :]
    turns = np.arange(len(last)) * (timestep / period)
    fundamentals = np.exp(-2j * np.pi * turns) @ (last - last.mean(axis=0))
    sizes = np.abs(fundamentals)
    lags = np.mod((np.angle(fundamentals[0]) - np.angle(fundamentals)) / (2 * np.pi), 1.0)
    still = sizes <= STILL * max(sizes.max(), len(last) * STILL)
    return np.where(still | still[0], np.nan, lags)


def phase_lag_error(lags: Array, target: Target) -> float:
    """Largest difference of phase lags (n,) from the target's, in periods, at most 1/2.

    Infinite if a leg has no phase.
    """
    away = np.abs(np.mod(lags - target_phase_lags(target) + 0.5, 1.0) - 0.5)
    return np.inf if np.isnan(away).any() else float(away.max())


def duty_factor_error(duties: Array, target: Target) -> float:
    """Largest difference of duty factors (n,) from the target's; infinite if one is NaN."""
    away = np.abs(duties - target_duty_factors(target))
    return np.inf if np.isnan(away).any() else float(away.max())


def switching_time(
    outputs: Array, timestep: float, target: Target, *, tolerance: float = 0.05
) -> float:
    """Time [s] from which on outputs (T, n) stay within the tolerance of the gait, by the period.

    `metrics.recovery_time` in the space of (x(t), x(t + T* / 4)), T* the target's period: in
    the space of x(t) alone, legs in phase or antiphase draw a thin loop or a line, on which a
    body at rest lies as well as one that trots too fast.

    Raises:
        InvalidArgumentError: wrong shape, NaN, or less than a quarter of a period.
    """
    values = as_array("outputs", outputs, (None, target.n_outputs))
    later = round(target.period / 4 / timestep)
    if later >= len(values):
        got = f"{len(values) * timestep:g} s"
        raise InvalidArgumentError("outputs", f"more than {target.period / 4:g} s", got)
    pairs = np.hstack([values[:-later], values[later:]])
    return orbits.recovery_time(pairs, timestep, delay_embedding(target), tolerance=tolerance)


@functools.lru_cache(maxsize=16)
def delay_embedding(target: Target) -> Target:
    """The target (x(t), x(t + T / 4)), with twice the outputs: a circle for a sine."""
    quarter = target.period / 4

    def curve(times: Array) -> Array:
        return np.hstack([target.sample(times), target.sample(times + quarter)])

    return Target(f"{target.name} and a quarter later", target.period, curve)


def target_phase_lags(target: Target) -> Array:
    """Phase lags (n,) of a target's legs behind the first, in periods."""
    points = orbits.ORBIT_POINTS
    return phase_lags(target.orbit(points), target.period / points, target.period)


def target_duty_factors(target: Target) -> Array:
    """Duty factors (n,) of a target's legs."""
    orbit = target.orbit(orbits.ORBIT_POINTS)
    around = np.vstack([orbit[-1:], orbit, orbit[:1]])
    found: Array = in_stance(around)[1:-1].mean(axis=0)
    return found


def _whole_periods(outputs: Array, timestep: float, period: float) -> int:
    """Rows of as many whole periods as fit."""
    require_number("timestep", timestep, 0.0, open_low=True)
    require_number("period", period, 0.0, open_low=True)
    cycles = int((len(outputs) + 0.5) * timestep / period)
    if cycles < 1:
        raise InvalidArgumentError(
            "outputs", f"at least a period of {period:g} s", f"{len(outputs) * timestep:g} s"
        )
    return min(len(outputs), round(cycles * period / timestep))
