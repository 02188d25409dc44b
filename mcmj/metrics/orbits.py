"""Errors of generated outputs; each name says its definition."""

import numpy as np

from mcmj.metrics.lags import mean_mismatch, relative_mismatch
from mcmj.metrics.nearest import distances_to_curve, rows_within
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_number

PERIODS_NEEDED = 1.5  # to measure a period
REPEATS = 0.05  # relative mismatch below which outputs count as repeating
ORBIT_POINTS = 4096  # of a target's polygon: chords are off by about 1e-6 of its size


def rms_radius(orbit: Array) -> float:
    """Root mean square distance of an orbit (P, n) from its mean."""
    return float(np.sqrt(((orbit - orbit.mean(axis=0)) ** 2).sum(axis=1).mean()))


def orbit_error(outputs: Array, target: Target) -> float:
    """Distance between the generated and the target orbit in the phase plane, no phase.

    The larger of two RMS distances, over the target's RMS radius: from every output to the
    nearest point of the target orbit (is everything generated on the orbit?), and from every
    point of the target orbit to the nearest output (is all of the orbit covered?).

    Args:
        outputs: (T, n_outputs), at least one period long.

    Raises:
        InvalidArgumentError: wrong shape, or NaN.
    """
    generated = as_array("outputs", outputs, (None, target.n_outputs))
    wanted = target.orbit(ORBIT_POINTS)
    there = distances_to_curve(generated, wanted, closed=True)
    back = distances_to_curve(wanted, generated, closed=False)
    return max(_rms(there), _rms(back)) / rms_radius(wanted)


def orbit_distances(outputs: Array, target: Target) -> Array:
    """Distances (T,) of outputs (T, n_outputs) to the target orbit, over its RMS radius."""
    generated = as_array("outputs", outputs, (None, target.n_outputs))
    wanted = target.orbit(ORBIT_POINTS)
    return distances_to_curve(generated, wanted, closed=True) / rms_radius(wanted)


def recovery_time(
    outputs: Array, timestep: float, target: Target, *, tolerance: float = 0.05
) -> float:
    """Time [s] from which on the outputs (T, n_outputs) stay within the tolerance of the orbit.

    From there on, the RMS distance from the target orbit over every period is at most tolerance x
    the orbit's RMS radius; infinite unless it is over the last one.
    """
    require_number("tolerance", tolerance, 0.0, open_low=True)
    generated = as_array("outputs", outputs, (None, target.n_outputs))
    wanted = target.orbit(ORBIT_POINTS)
    rows = round(target.period / timestep)
    inside = rows_within(generated, wanted, tolerance * rms_radius(wanted), rows)
    return (len(generated) - inside) * timestep if inside >= rows else np.inf


def period(outputs: Array, timestep: float, guess: float) -> float:
    """Mean period [s] of outputs (T, n): the lag at which they repeat, over many periods.

    First the smallest lag from 0.2 to 3 times the guess at which the outputs repeat: a minimum
    of their mean squared difference from their lagged copy, over twice their variance, below
    0.05 and as deep as the deepest. Then as many whole periods as fit into half of the samples,
    to a fraction of a sample.

    Args:
        guess: expected period [s].

    Returns:
        The period, or NaN if the outputs do not repeat at any of these lags.

    Raises:
        InvalidArgumentError: outputs at rest, or shorter than 1.5 periods of the guess.
    """
    require_number("timestep", timestep, 0.0, open_low=True)
    require_number("guess", guess, 0.0, open_low=True)
    values = as_array("outputs", outputs, (None, None))
    if _at_rest(values):
        raise InvalidArgumentError("outputs", "something that moves", "outputs at rest")
    if len(values) * timestep < PERIODS_NEEDED * guess:
        raise InvalidArgumentError(
            "outputs",
            f"at least {PERIODS_NEEDED} periods of {guess:g} s",
            f"{len(values) * timestep:g} s",
        )
    coarse, spacing = _first_repeat(values, guess / timestep)
    if np.isnan(coarse):
        return np.nan
    estimate = _best_lag(values, coarse, max(3.0, 2.0 * spacing))
    cycles = 1
    while 2 * (cycles + 1) * estimate < len(values):
        cycles += 1
        lag = _best_lag(values, cycles * estimate, max(3.0, 0.02 * estimate))
        estimate = lag / cycles
    return float(estimate * timestep)


def period_or_nan(outputs: Array, timestep: float, target: Target) -> float:
    """Mean period [s] of outputs near a target's; NaN if they rest or do not repeat."""
    values = as_array("outputs", outputs, (None, target.n_outputs))
    return np.nan if _at_rest(values) else period(values, timestep, target.period)


def relative_period_error(outputs: Array, timestep: float, target: Target) -> float:
    """|T - T*| / T*, T the outputs' mean period and T* the target's; infinite without a period."""
    found = period_or_nan(outputs, timestep, target)
    return np.inf if np.isnan(found) else abs(found / target.period - 1.0)


def relative_amplitude_error(outputs: Array, target: Target) -> float:
    """Largest over the outputs of |A - A*| / A*, A the range (max - min) of an output."""
    values = as_array("outputs", outputs, (None, target.n_outputs))
    wanted = _ranges(target.orbit(ORBIT_POINTS))
    return float(np.abs(_ranges(values) / wanted - 1.0).max())


def nrmse_std(outputs: Array, targets: Array) -> float:
    """sqrt(mean (y - y*)^2) / std(y*), all outputs together; 1 for the targets' mean.

    Args:
        outputs, targets: (T, n_outputs); std is that of the targets about their means.

    Raises:
        InvalidArgumentError: shapes that differ, NaN, or targets that never change.
    """
    return float(np.sqrt(nmse_var(outputs, targets)))


def nrmse_range(outputs: Array, targets: Array) -> float:
    """sqrt(mean (y - y*)^2 / (max y* - min y*)^2), the mean over samples and outputs.

    Args, Raises: as for `nrmse_std`.
    """
    found, wanted = _pair(outputs, targets)
    return _rms((found - wanted) / _ranges(wanted))


def nmse_var(outputs: Array, targets: Array) -> float:
    """mean (y - y*)^2 / var(y*), all outputs together: the square of `nrmse_std`.

    Args, Raises: as for `nrmse_std`.
    """
    found, wanted = _pair(outputs, targets)
    return float(((found - wanted) ** 2).sum() / ((wanted - wanted.mean(axis=0)) ** 2).sum())


def _pair(outputs: Array, targets: Array) -> tuple[Array, Array]:
    wanted = as_array("targets", targets, (None, None))
    found = as_array("outputs", outputs, wanted.shape)
    still = np.flatnonzero(_ranges(wanted) == 0.0)
    if still.size:
        raise InvalidArgumentError("targets", "columns that change", f"column {still[0]} constant")
    return found, wanted


def _ranges(values: Array) -> Array:
    """Largest minus smallest value of every column, quickly."""
    columns = np.ascontiguousarray(values.T)
    found: Array = columns.max(axis=1) - columns.min(axis=1)
    return found


def _at_rest(values: Array) -> bool:
    return bool((_ranges(values) <= 1e-9 * (1.0 + np.abs(values).max())).all())


def _rms(distances: Array) -> float:
    return float(np.sqrt((distances**2).mean()))


def _first_repeat(values: Array, guess: float) -> tuple[float, int]:
    """Smallest lag [samples] at which values repeat (NaN: none), and the spacing searched."""
    highest = min(3.0 * guess, 0.8 * len(values))
    spacing = max(1, int(guess / 400))
    sparse = values[::spacing] - values.mean(axis=0)
    lags = np.arange(max(1, int(0.2 * guess / spacing)), int(highest / spacing))
    costs = relative_mismatch(sparse, lags)
    inside = np.flatnonzero((costs[1:-1] <= costs[:-2]) & (costs[1:-1] <= costs[2:])) + 1
    deep = inside[costs[inside] < min(REPEATS, costs[inside].min(initial=REPEATS) + 0.01)]
    return (float(lags[deep[0]] * spacing) if deep.size else np.nan), spacing


def _best_lag(values: Array, centre: float, reach: float) -> float:
    """Lag, in samples and fractions, near `centre` at which values repeat best."""
    low = max(1, int(np.floor(centre - reach)))
    high = min(len(values) - 2, int(np.ceil(centre + reach)))
    lags = np.arange(low, high + 1)
    costs = mean_mismatch(values, lags)
    best = int(np.clip(costs.argmin(), 1, len(lags) - 2))
    left, middle, right = costs[best - 1 : best + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend > 0 else 0.0
    return float(lags[best] + np.clip(shift, -1.0, 1.0))
