"""Which springs must be sensed: orders against brute force, readouts of few springs."""

import itertools

import numpy as np
import pytest

from mcmj.core.random_body import BodySettings
from mcmj.experiments.prune import run as prune
from mcmj.experiments.prune.config import total_runs
from mcmj.learning.lessons import Teaching
from mcmj.learning.regression import Regression, fit_readout
from mcmj.learning.spring_selection import importance, sense_only
from mcmj.utils.errors import UnknownNameError


def problem(seed, *, springs=7, rows=200, bias=False):
    rng = np.random.default_rng(seed)
    lengths = 20.0 + rng.normal(size=(rows, springs)) @ rng.normal(size=(springs, springs))
    targets = (
        lengths @ rng.normal(size=(springs, 2)) + 0.5 * rng.normal(size=(rows, 2)) + 3.0 * bias
    )
    regression = Regression(bias=bias)
    for first in range(0, rows, 60):
        regression.add(lengths[first : first + 60], targets[first : first + 60])
    return lengths, targets, regression


def cost(lengths, targets, springs, ridge, bias):
    """|A W - Y|^2 + ridge |W|^2 of the best W that reads only some springs, from the samples."""
    columns = lengths[:, list(springs)]
    w = fit_readout(columns, targets, ridge, bias=bias)
    read = columns @ w[: len(springs)] + (w[len(springs)] if bias else 0.0)
    return ((read - targets) ** 2).sum() + ridge * (w[: len(springs)] ** 2).sum()


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("ridge", [0.0, 5.0])
@pytest.mark.parametrize("seed", range(4))
def test_greedy_orders_are_greedy(seed, ridge, bias):
    """Each step is the best of all single steps, found by fitting every one of them anew."""
    lengths, targets, regression = problem(seed, bias=bias)
    springs = range(lengths.shape[1])
    forward = importance(regression, ridge, "forward").tolist()
    for k in springs:
        best = min(
            set(springs) - set(forward[:k]),
            key=lambda j, k=k: cost(lengths, targets, [*forward[:k], j], ridge, bias),
        )
        assert forward[k] == best
    backward = importance(regression, ridge, "backward").tolist()
    for k in reversed(springs[1:]):
        left = backward[: k + 1]
        worst = min(
            left,
            key=lambda j, left=left: cost(
                lengths, targets, [i for i in left if i != j], ridge, bias
            ),
        )
        assert backward[k] == worst


@pytest.mark.parametrize("bias", [False, True])
def test_a_readout_of_some_springs_is_the_regression_on_them(bias):
    lengths, targets, regression = problem(9, bias=bias)
    for springs in itertools.combinations(range(7), 3):
        w_out = sense_only(regression, np.array(springs), 2.0)
        expected = fit_readout(lengths[:, springs], targets, 2.0, bias=bias)
        assert np.allclose(w_out[list(springs)], expected[:3], rtol=1e-8, atol=1e-10)
        assert np.allclose(w_out[7:], expected[3:], rtol=1e-8)
        assert np.count_nonzero(w_out[:7].any(axis=1)) == 3


@pytest.mark.parametrize("method", ["forward", "backward", "random"])
def test_springs_that_say_the_same_are_each_in_the_order_once(method):
    rng = np.random.default_rng(0)
    lengths = rng.normal(size=(50, 3))
    twice = np.hstack([lengths, lengths[:, :2]])
    regression = Regression()
    regression.add(twice, lengths @ rng.normal(size=(3, 2)))
    order = importance(regression, 0.0, method)
    assert sorted(order) == list(range(5))
    if method == "forward":  # three tell all; the copies come last
        assert np.linalg.matrix_rank(twice[:, order[:3]]) == 3


def test_an_unknown_method_is_named():
    with pytest.raises(UnknownNameError, match="valid choices: backward, forward, random"):
        importance(problem(0)[2], 0.0, "l1")


def test_few_well_chosen_springs_run_the_loop():
    config = prune.Config(
        seed=3, engine="twin", starts=2, free_run=40.0, counts=(2, 8, 16), methods=("backward",),
        settings=BodySettings(nodes=16), teaching=Teaching(duration=60.0, bias=True),
    )  # fmt: skip
    result = prune.run(config)
    errors = result.errors("backward")[0]
    assert result.bodies[0].full_error < 0.05
    assert errors[2] < 0.05 < errors[0]
    assert result.needed("backward", 0) in (8, 16)
    mujoco = prune.run(prune.Config(**{**vars(config), "engine": "mujoco"}))
    assert np.allclose(mujoco.errors("backward")[0][2], errors[2], rtol=1e-3)
    assert total_runs(config) == 4
