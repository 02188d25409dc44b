"""Mismatches of a signal and its lagged copies against their definitions in NumPy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mcmj.metrics.lags import mean_mismatch, relative_mismatch


@given(seed=st.integers(0, 2**32), width=st.integers(1, 4))
def test_both_are_as_defined(seed, width):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(50, width)).cumsum(axis=0)
    values -= values.mean(axis=0)
    lags = np.arange(3, 40, 4)
    for k, lag in enumerate(lags):
        head, tail = values[:-lag], values[lag:]
        power = (head**2).sum() + (tail**2).sum()
        wanted = ((head - tail) ** 2).sum() / power
        assert abs(relative_mismatch(values, lags)[k] - wanted) < 1e-13 * (values**2).sum() / power
        window = len(values) - lags[-1]
        wanted = ((values[lag : lag + window] - values[:window]) ** 2).mean()
        assert abs(mean_mismatch(values, lags)[k] / wanted - 1) < 1e-13


def test_a_signal_that_is_zero_does_not_repeat():
    assert (relative_mismatch(np.zeros((10, 2)), np.arange(1, 5)) == 1.0).all()
