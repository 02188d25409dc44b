"""Amplitude and frequency of a rhythm from cycle to cycle, for signals that change slowly."""

from dataclasses import dataclass

import numpy as np

from mcmj.utils.validation import Array, as_array, require_number


@dataclass(frozen=True)
class Cycles:
    """The whole cycles of a signal, one entry each.

    Attributes:
        times: (C,) of their middles [s].
        amplitudes: (C,) half the range within each.
        frequencies: (C,) 1 / duration [Hz].
    """

    times: Array
    amplitudes: Array
    frequencies: Array


def cycles(values: Array, timestep: float) -> Cycles:
    """Cut a signal (T,) at its upward passages through zero, found between the samples.

    A signal without a whole cycle gives none.

    Raises:
        InvalidArgumentError: a wrong shape, or NaN.
    """
    require_number("timestep", timestep, 0.0, open_low=True)
    signal = as_array("values", values, (None,))
    before = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    if len(before) < 2:
        return Cycles(*np.empty((3, 0)))
    fraction = signal[before] / (signal[before] - signal[before + 1])
    crossings = timestep * (before + fraction)
    first = before[:-1] + 1
    within = signal[first[0] : before[-1] + 1]
    highest = np.maximum.reduceat(within, first - first[0])
    lowest = np.minimum.reduceat(within, first - first[0])
    return Cycles(
        times=0.5 * (crossings[1:] + crossings[:-1]),
        amplitudes=0.5 * (highest - lowest),
        frequencies=1.0 / np.diff(crossings),
    )
