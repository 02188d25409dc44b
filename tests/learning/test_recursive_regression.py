"""Recursive least squares against the normal equations, sample by sample."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.core.callbacks.online_learning import Learner, correct
from mcmj.learning.recursive_regression import learner_after
from mcmj.learning.regression import Regression
from mcmj.utils.errors import InvalidArgumentError


def ridge_solution(features, wanted, ridge):
    gram = features.T @ features + ridge * np.eye(features.shape[1])
    return np.linalg.solve(gram, features.T @ wanted)


def beginning(n, m, ridge):
    return Learner(np.eye(n) / np.sqrt(ridge), np.zeros((m, n)), np.zeros(n - 1), np.ones(n - 1))


def learn(learner, features, wanted):
    correct(learner, features, wanted, np.empty(len(features)), np.empty(len(features)))


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 3), st.sampled_from([1e-3, 1.0])
)
def test_after_every_sample_it_is_the_ridge_regression_of_all_so_far(seed, n, m, ridge):
    rng = np.random.default_rng(seed)
    features, wanted = rng.normal(size=(12, n)), rng.normal(size=(12, m))
    learner = beginning(n, m, ridge)
    for k in range(len(features)):
        learn(learner, features[k], wanted[k])
        expected = ridge_solution(features[: k + 1], wanted[: k + 1], ridge)
        assert np.abs(learner.weights.T - expected).max() < 4e-12 * max(1.0, np.abs(expected).max())


def test_thousands_of_samples_with_hardly_any_ridge():
    rng = np.random.default_rng(0)
    features = 3e-3 * rng.normal(size=(4000, 60)) @ rng.normal(size=(60, 60))
    wanted = rng.normal(size=(4000, 8))
    learner = beginning(60, 8, 5e-9)
    for f, y in zip(features, wanted, strict=True):
        learn(learner, f, y)
    expected = ridge_solution(features, wanted, 5e-9)
    assert np.abs(learner.weights.T - expected).max() < 1e-12 * np.abs(expected).max()


def test_its_covariance_stays_definite_where_the_textbooks_does_not():
    """A ridge below the rounding error of what the features hold: two that are nearly one."""
    rng = np.random.default_rng(1)
    common = 1e3 * rng.normal(size=(3000, 1))
    features = np.hstack([common, common + 1e-6 * rng.normal(size=(3000, 1)), np.ones((3000, 1))])
    wanted = rng.normal(size=(3000, 1))
    learner, p = beginning(3, 1, 1e-12), np.eye(3) / 1e-12
    worst = np.inf
    for f, y in zip(features, wanted, strict=True):
        learn(learner, f, y)
        p = p - np.outer(p @ f, p @ f) / (1.0 + f @ p @ f)
        worst = min(worst, np.linalg.eigvalsh(p).min())
    assert worst < 0.0
    singular = np.linalg.svd(learner.root, compute_uv=False)
    expected = np.linalg.svd(np.vstack([features, 1e-6 * np.eye(3)]), compute_uv=False)[::-1]
    assert np.abs(singular * expected - 1.0).max() < 1e-6


@pytest.mark.parametrize("ridge", [1e-6, 1.0])
def test_it_goes_on_from_a_batch_in_any_units(ridge):
    """Signals in metres or in micrometres: the same outputs, and those of a batch."""
    rng = np.random.default_rng(2)
    signals = 40.0 + rng.normal(size=(500, 8)) @ rng.normal(size=(8, 8))
    wanted, units = rng.normal(size=(500, 2)), 10.0 ** rng.integers(-6, 6, 8)
    outputs = []
    for scale in (np.ones(8), units):
        batch = Regression(bias=True)
        batch.add(signals[:300] * scale, wanted[:300])
        learner = learner_after(batch, ridge)
        rows = (signals * scale - learner.mean) * learner.inverse_spread
        features = np.column_stack([rows, np.ones(500)])
        assert rows[:300].mean(axis=0) == pytest.approx(np.zeros(8), abs=1e-13)
        assert rows[:300].std(axis=0) == pytest.approx(np.ones(8), rel=1e-13)
        for f, y in zip(features[300:], wanted[300:], strict=True):
            learn(learner, f, y)
        outputs.append(features @ learner.weights.T)
    penalty = ridge * np.diag([*np.ones(8), 0.0])
    w = np.linalg.solve(features.T @ features + penalty, features.T @ wanted)
    assert np.abs(outputs[0] - features @ w).max() < 4e-14
    assert np.abs(outputs[0] - outputs[1]).max() < 4e-14


def test_a_signal_that_stands_still_is_left_out():
    rng = np.random.default_rng(3)
    signals, wanted = rng.normal(size=(50, 3)), rng.normal(size=(50, 1))
    signals[:, 1] = 7.0 + 1e-14 * rng.normal(size=50)
    batch = Regression(bias=True)
    batch.add(signals, wanted)
    learner = learner_after(batch, 1e-3)
    assert learner.inverse_spread[1] == 0.0
    assert learner.weights[0, 1] == 0.0
    assert np.isfinite(learner.root).all()


@pytest.mark.parametrize("ridge", [0.0, -1.0, np.nan])
def test_ridge_must_be_positive(ridge):
    batch = Regression(bias=True)
    batch.add(np.ones((3, 1)), np.ones((3, 1)))
    with pytest.raises(InvalidArgumentError, match="ridge"):
        learner_after(batch, ridge)
