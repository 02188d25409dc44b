"""Tolerances: thresholds that are known, the median's interval, and those of a taught body."""

import numpy as np
import pytest
from scipy.stats import quantile_test

from mcmj.analysis.stability.basin import on_cycle
from mcmj.analysis.stability.tolerance import (
    Tolerance,
    Trial,
    force_tolerance,
    largest_tolerated,
    noise_tolerance,
)
from mcmj.utils.errors import InvalidArgumentError


def test_bisection_finds_every_copys_threshold():
    thresholds = np.array([3.0, 0.2, 77.0, 0.02])
    found = largest_tolerated(lambda a: a < thresholds, 4, 0.01, 100.0, ratio=1.01).values
    assert (found < thresholds).all()
    assert (thresholds < 1.01 * found).all()


def test_a_copy_without_a_threshold_is_at_the_end_of_the_range():
    always, never = np.array([True, False]), np.array([False, True])
    found = largest_tolerated(lambda a: always, 2, 1.0, 2.0)
    np.testing.assert_array_equal(found.values, [2.0, 0.0])
    assert (found.least, found.median) == (0.0, 1.0)
    again = largest_tolerated(lambda a: never, 2, 1.0, 2.0)
    np.testing.assert_array_equal(again.values, [0.0, 2.0])
    with pytest.raises(InvalidArgumentError, match="ratio"):
        largest_tolerated(lambda a: always, 2, 1.0, 2.0, ratio=1.0)


@pytest.mark.parametrize("copies", [6, 7, 16, 50, 51])
def test_interval_of_the_median_is_that_of_the_sign_test(copies):
    values = np.random.default_rng(0).lognormal(size=copies)
    expected = quantile_test(values, p=0.5).confidence_interval(0.95)
    assert Tolerance(values).interval == pytest.approx((expected.low, expected.high), rel=1e-12)


def test_too_few_copies_have_no_interval():
    assert Tolerance(np.ones(5)).interval == (0.0, np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("bisect", [force_tolerance, noise_tolerance])
def test_a_bodys_tolerances_lie_within_their_range_and_repeat(taught_loop, bisect):
    loop, cycle, goal = taught_loop
    states = on_cycle(loop, cycle, 4)
    found, again = (bisect(loop, goal, states, Trial(recovery=30.0, ratio=2.0)) for _ in range(2))
    np.testing.assert_array_equal(found.values, again.values)
    assert (found.values > 0.0).all()
    assert found.values.max() < (1e4 if bisect is force_tolerance else 1e2)
