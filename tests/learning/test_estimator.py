"""The readout as an estimator: scikit-learn's own checks, and the same weights as fit_readout."""

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="the extra 'sklearn' is not installed")

from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit
from sklearn.utils.estimator_checks import parametrize_with_checks

import mcmj
from mcmj.learning.estimator import ReadoutRegressor
from mcmj.utils.errors import InvalidArgumentError


@parametrize_with_checks([ReadoutRegressor(), ReadoutRegressor(ridge=1e-3, bias=True)])
def test_scikit_learn_checks_the_estimator(estimator, check):
    check(estimator)


@pytest.mark.parametrize("bias", [False, True])
def test_weights_are_those_of_another_ridge_regression(bias):
    """Scikit-learn's, which centres instead of adding a column."""
    rng = np.random.default_rng(0)
    signals, targets = rng.normal(3.0, 1.0, (200, 8)), rng.normal(1.0, 1.0, (200, 2))
    ours = ReadoutRegressor(ridge=2.0, bias=bias).fit(signals, targets)
    theirs = Ridge(2.0, fit_intercept=bias).fit(signals, targets)
    assert ours.w_out_.shape == (8 + bias, 2)
    assert ours.w_out_[:8] == pytest.approx(theirs.coef_.T, abs=1e-12)
    assert ours.predict(signals) == pytest.approx(theirs.predict(signals), abs=1e-12)


def test_a_search_finds_the_ridge_and_the_readout_runs_a_body():
    body = mcmj.random_body(0, nodes=12)
    sim, goal = mcmj.Simulation(body), mcmj.target("quadratic")
    times = 1e-3 * np.arange(12_000)
    run = sim.rollout(offset=goal.sample(times), gate=0.0)
    rows = slice(4000, None, 10)
    search = GridSearchCV(ReadoutRegressor(), {"ridge": [0.0, 1e9]}, cv=TimeSeriesSplit(3))
    search.fit(run.lengths[rows], goal.sample(times)[rows])
    assert search.best_params_ == {"ridge": 0.0}
    w_out = search.best_estimator_.w_out_
    assert np.isfinite(mcmj.Simulation(body, w_out=w_out).rollout(100).outputs).all()


def test_what_cannot_be_is_said():
    with pytest.raises(InvalidArgumentError, match="ridge: expected a number in"):
        ReadoutRegressor(ridge=-1.0).fit([[1.0], [2.0]], [1.0, 2.0])
