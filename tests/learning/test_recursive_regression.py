"""Recursive least squares against the normal equations, sample by sample."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.learning.recursive_regression import RecursiveLeastSquares
from mcmj.utils.errors import InvalidArgumentError


def ridge_solution(features, wanted, ridge):
    gram = features.T @ features + ridge * np.eye(features.shape[1])
    return np.linalg.solve(gram, features.T @ wanted)


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 3), st.sampled_from([1e-3, 1.0])
)
def test_after_every_sample_it_is_the_ridge_regression_of_all_so_far(seed, n, m, ridge):
    rng = np.random.default_rng(seed)
    features, wanted = rng.normal(size=(12, n)), rng.normal(size=(12, m))
    squares = RecursiveLeastSquares(n, m, ridge=ridge)
    for k in range(len(features)):
        before = squares.weights
        error = squares.update(features[k], wanted[k])
        assert error == pytest.approx(before.T @ features[k] - wanted[k])
        expected = ridge_solution(features[: k + 1], wanted[: k + 1], ridge)
        assert np.abs(squares.weights - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())


def test_thousands_of_samples_with_hardly_any_ridge():
    rng = np.random.default_rng(0)
    features = 3e-3 * rng.normal(size=(4000, 60)) @ rng.normal(size=(60, 60))
    wanted = rng.normal(size=(4000, 8))
    squares = RecursiveLeastSquares(60, 8, ridge=5e-9)
    for f, y in zip(features, wanted, strict=True):
        squares.update(f, y)
    expected = ridge_solution(features, wanted, 5e-9)
    assert np.abs(squares.weights - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("ridge", [0.0, -1.0, np.nan])
def test_ridge_must_be_positive(ridge):
    with pytest.raises(InvalidArgumentError, match="ridge"):
        RecursiveLeastSquares(3, 1, ridge=ridge)
