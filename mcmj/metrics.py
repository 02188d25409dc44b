"""Errors of generated outputs; each name says its definition."""

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from mcmj.errors import InvalidArgumentError
from mcmj.targets import Target
from mcmj.validation import Array, as_array, require_number

PERIODS_NEEDED = 1.5  # to measure a period
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
    there = _distances_to_curve(generated, wanted, closed=True)
    back = _distances_to_curve(wanted, generated, closed=False)
    return max(_rms(there), _rms(back)) / rms_radius(wanted)


def period(outputs: Array, timestep: float, guess: float) -> float:
    """Mean period [s] of outputs (T, n): the lag at which they repeat best, over many periods.

    The lag is as many whole periods as fit into half of the samples; the squared difference
    between the outputs and their lagged copy is minimised around it to a fraction of a sample.

    Args:
        guess: expected period [s]; the true one is looked for within 20 %.

    Raises:
        InvalidArgumentError: outputs at rest, or shorter than 1.5 periods of the guess.
    """
    require_number("timestep", timestep, 0.0, open_low=True)
    require_number("guess", guess, 0.0, open_low=True)
    values = as_array("outputs", outputs, (None, None))
    if (np.ptp(values, axis=0) <= 1e-9 * (1.0 + np.abs(values).max())).all():
        raise InvalidArgumentError("outputs", "something that moves", "outputs at rest")
    if len(values) * timestep < PERIODS_NEEDED * guess:
        raise InvalidArgumentError(
            "outputs",
            f"at least {PERIODS_NEEDED} periods of {guess:g} s",
            f"{len(values) * timestep:g} s",
        )
    estimate = _best_lag(values, guess / timestep, 0.2 * guess / timestep)
    cycles = 1
    while 2 * (cycles + 1) * estimate < len(values):
        cycles += 1
        lag = _best_lag(values, cycles * estimate, max(3.0, 0.02 * estimate))
        estimate = lag / cycles
    return float(estimate * timestep)


def relative_period_error(outputs: Array, timestep: float, target: Target) -> float:
    """|T - T*| / T*, T the outputs' mean period and T* the target's."""
    return abs(period(outputs, timestep, target.period) / target.period - 1.0)


def relative_amplitude_error(outputs: Array, target: Target) -> float:
    """Largest over the outputs of |A - A*| / A*, A the range (max - min) of an output."""
    values = as_array("outputs", outputs, (None, target.n_outputs))
    wanted = np.ptp(target.orbit(ORBIT_POINTS), axis=0)
    return float(np.abs(np.ptp(values, axis=0) / wanted - 1.0).max())


def _rms(distances: Array) -> float:
    return float(np.sqrt((distances**2).mean()))


def _distances_to_curve(points: Array, curve: Array, *, closed: bool) -> Array:
    """Distances (P,) to a polygon: to the segments on both sides of the nearest vertex."""
    _, nearest = cKDTree(curve).query(points)
    last = len(curve) - 1
    before = nearest - 1 if closed else np.maximum(nearest - 1, 0)
    after = np.where(nearest == last, 0 if closed else last, nearest + 1)
    vertex = curve[nearest]
    sides = [_to_segment(points, vertex, curve[other]) for other in (before, after)]
    return np.minimum(*sides)


def _to_segment(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    squared = (along**2).sum(axis=1)
    fraction = ((points - start) * along).sum(axis=1) / np.where(squared > 0, squared, 1.0)
    foot = start + np.clip(fraction, 0.0, 1.0)[:, None] * along
    return np.linalg.norm(points - foot, axis=1)


def _best_lag(values: Array, centre: float, reach: float) -> float:
    """Lag, in samples and fractions, near `centre` at which values repeat best."""
    low = max(1, int(np.floor(centre - reach)))
    high = min(len(values) - 2, int(np.ceil(centre + reach)))
    lags = np.arange(low, high + 1)
    costs = _mismatch(values, lags.astype(np.int64))
    best = int(np.clip(costs.argmin(), 1, len(lags) - 2))
    left, middle, right = costs[best - 1 : best + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend > 0 else 0.0
    return float(lags[best] + np.clip(shift, -1.0, 1.0))


def _mismatch(values: Array, lags: npt.NDArray[np.int64]) -> Array:
    """Mean squared difference between values and their lagged copies, same window for all."""
    window = len(values) - int(lags[-1])
    head = values[:window]
    return np.array([((values[lag : lag + window] - head) ** 2).mean() for lag in lags])
