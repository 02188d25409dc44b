"""How much a signal differs from its lagged copies."""

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.fft import irfft, next_fast_len, rfft

from mcmj.utils.validation import Array

_SUM = {"contract", "reassoc"}  # sums in any order: several at a time


def relative_mismatch(values: Array, lags: npt.NDArray[np.int64]) -> Array:
    """Mean squared difference from the copies, over twice the overlap's variance.

    From the autocorrelation by FFT: good to some 1e-15, not in proportion to itself.

    Args:
        values: (T, n), with means of 0.
        lags: each below T.
    """
    count = len(values)
    size = next_fast_len(2 * count, real=True)
    spectrum = rfft(values, size, axis=0)
    products = irfft((spectrum.real**2 + spectrum.imag**2).sum(axis=1), size)[lags]
    until = np.concatenate([[0.0], np.cumsum((values**2).sum(axis=1))])
    power = until[count - lags] + (until[count] - until[lags])
    return 1.0 - np.divide(2 * products, power, out=np.zeros(len(lags)), where=power > 0)


def mean_mismatch(values: Array, lags: npt.NDArray[np.int64]) -> Array:
    """Mean squared differences between values (T, n) and their copies, same window for all.

    Args:
        lags: ascending, the last below T.
    """
    flat, width = np.ascontiguousarray(values).ravel(), values.shape[1]
    window = width * (len(values) - int(lags[-1]))
    found = np.empty(len(lags))
    _mean(flat, width * np.asarray(lags, np.int64), window, found)
    return found


@njit(cache=True, nogil=True, fastmath=_SUM)
def _mean(flat, lags, window, found):
    for k in range(lags.size):
        total = 0.0
        for i in range(window):
            total += (flat[i + lags[k]] - flat[i]) ** 2
        found[k] = total / window
