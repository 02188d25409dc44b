"""Least squares and ridge against NumPy, the augmented system and the closed form."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj import fit_readout
from mcmj.learning.regression import Regression
from mcmj.utils.errors import InvalidArgumentError

seeds = st.integers(0, 2**32)
RIDGES = (0.0, 1e-6, 1e-2, 10.0)


def problem(seed, rows=60, columns=7, outputs=2):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(rows, columns)) + 0.5, rng.normal(size=(rows, outputs)) - 2.0


def with_singular_values(values, rows=40, seed=0):
    """A matrix that has these singular values."""
    rng = np.random.default_rng(seed)
    u, _ = np.linalg.qr(rng.normal(size=(rows, len(values))))
    v, _ = np.linalg.qr(rng.normal(size=(len(values), len(values))))
    return u * values @ v.T


def solve(x, y, ridge=0.0, *, bias=False, chunks=1):
    regression = Regression(bias=bias)
    for a, b in zip(np.array_split(x, chunks), np.array_split(y, chunks), strict=True):
        regression.add(a, b)
    return regression.solve(ridge)


@given(seed=seeds)
def test_least_squares_equals_lstsq(seed):
    x, y = problem(seed)
    assert np.abs(fit_readout(x, y) - np.linalg.lstsq(x, y)[0]).max() < 1e-13


@given(seed=seeds)
def test_bias_is_a_column_of_ones_in_the_last_row(seed):
    x, y = problem(seed)
    ones = np.column_stack([x, np.ones(len(x))])
    wanted = np.linalg.lstsq(ones, y)[0]
    assert np.abs(fit_readout(x, y, bias=True) - wanted).max() < 1e-13


@given(seed=seeds, ridge=st.sampled_from(RIDGES))
def test_ridge_equals_the_augmented_system_and_the_closed_form(seed, ridge):
    x, y = problem(seed)
    n = x.shape[1]
    w = fit_readout(x, y, ridge)
    augmented = np.linalg.lstsq(
        np.vstack([x, np.sqrt(ridge) * np.eye(n)]), np.vstack([y, np.zeros((n, 2))])
    )[0]
    closed = np.linalg.solve(x.T @ x + ridge * np.eye(n), x.T @ y)
    assert np.abs(w - augmented).max() < 1e-13
    assert np.abs(w - closed).max() < 1e-12


@given(seed=seeds, ridge=st.sampled_from(RIDGES))
def test_the_bias_is_not_penalised(seed, ridge):
    """Ridge on centred data, the bias from the means."""
    x, y = problem(seed)
    mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)
    centred = x - mean_x
    w = np.linalg.solve(centred.T @ centred + ridge * np.eye(x.shape[1]), centred.T @ (y - mean_y))
    fitted = fit_readout(x, y, ridge, bias=True)
    assert np.abs(fitted[:-1] - w).max() < 1e-12
    assert np.abs(fitted[-1] - (mean_y - mean_x @ w)).max() < 1e-12


def test_an_infinite_ridge_leaves_only_the_bias():
    x, y = problem(0)
    fitted = fit_readout(x, y, 1e14, bias=True)
    assert np.abs(fitted[:-1]).max() < 1e-10
    assert fitted[-1] == pytest.approx(y.mean(axis=0), rel=1e-9)


@given(seed=seeds, cuts=st.lists(st.integers(0, 60), max_size=6), bias=st.booleans(),
       ridge=st.sampled_from(RIDGES))  # fmt: skip
def test_incremental_equals_one_shot(seed, cuts, bias, ridge):
    """Whatever the chunks, also empty ones and ones with fewer rows than columns."""
    x, y = problem(seed)
    regression = Regression(bias=bias)
    edges = [0, *sorted(cuts), len(x)]
    for a, b in pairwise(edges):
        regression.add(x[a:b], y[a:b])
    parts, whole = regression.solve(ridge), solve(x, y, ridge, bias=bias)
    assert np.abs(parts.w_out - whole.w_out).max() < 1e-13
    assert parts.train_nrmse == pytest.approx(whole.train_nrmse, rel=1e-12)
    assert parts.condition_number == pytest.approx(whole.condition_number, rel=1e-12)
    assert (parts.rank, parts.rows) == (whole.rank, whole.rows)


@pytest.mark.parametrize("ridge", RIDGES)
@pytest.mark.parametrize("bias", [False, True])
def test_train_nrmse_is_the_direct_computation(ridge, bias):
    x, y = problem(5)
    fit = solve(x, y, ridge, bias=bias, chunks=4)
    predicted = x @ fit.w_out[:7] + fit.w_out[7:].sum(axis=0)
    wanted = np.sqrt(((predicted - y) ** 2).sum() / ((y - y.mean(axis=0)) ** 2).sum())
    assert fit.train_nrmse == pytest.approx(wanted, rel=1e-12)
    assert fit.rows == 60


def test_train_nrmse_survives_a_large_mean():
    """The spread of targets is not the difference of two large squares."""
    x, y = problem(5)
    shifted = solve(x, y + 1e8, bias=True)
    assert shifted.train_nrmse == pytest.approx(solve(x, y, bias=True).train_nrmse, rel=1e-6)


@pytest.mark.parametrize("condition", [1.0, 1e3, 1e8, 1e12])
@pytest.mark.parametrize("chunks", [1, 5])
def test_condition_number_and_rank_of_constructed_data(condition, chunks):
    x = with_singular_values(np.geomspace(condition, 1.0, 6))
    fit = solve(x, np.ones((40, 1)) * np.arange(40)[:, None], chunks=chunks)
    assert fit.condition_number == pytest.approx(condition, rel=1e-15 * condition + 1e-13)
    assert fit.rank == 6


def test_exact_weights_are_found_through_a_large_condition_number():
    """Normal equations would lose all digits at 1e8."""
    x = with_singular_values(np.geomspace(1e8, 1.0, 6))
    w = np.arange(12.0).reshape(6, 2)
    assert np.abs(fit_readout(x, x @ w) - w).max() < 1e-6


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_rank_deficient_data_gives_the_minimum_norm_solution(rank):
    x = with_singular_values([*np.linspace(3, 1, rank), *[0.0] * (6 - rank)])
    y = np.random.default_rng(1).normal(size=(40, 2))
    fit = solve(x, y, chunks=3)
    assert fit.rank == rank
    assert fit.condition_number > 1e14
    assert np.abs(fit.w_out - np.linalg.pinv(x, rcond=1e-10) @ y).max() < 1e-13


def test_fewer_samples_than_springs_give_the_minimum_norm_solution():
    x, y = problem(2, rows=4)
    fit = solve(x, y)
    assert np.abs(fit.w_out - np.linalg.pinv(x) @ y).max() < 1e-13
    assert np.abs(x @ fit.w_out - y).max() < 1e-13
    assert fit.rank == 4
    assert fit.train_nrmse < 1e-13


def test_a_spring_that_never_moves_and_one_that_is_zero():
    """Constant columns are collinear with a bias; a zero column has weight 0."""
    x, y = problem(3)
    x[:, 2], x[:, 4] = 5.0, 0.0
    fit = solve(x, y, bias=True)
    ones = np.column_stack([x, np.ones(len(x))])
    assert fit.rank == 6
    assert np.abs(fit.w_out - np.linalg.pinv(ones, rcond=1e-12) @ y).max() < 1e-13


def test_data_without_any_signal():
    fit = solve(np.zeros((10, 3)), np.arange(10.0)[:, None])
    assert fit.rank == 0
    assert not fit.w_out.any()
    assert fit.condition_number == np.inf


def test_a_constant_target_has_no_spread_to_compare_with():
    """Never a NumPy warning: the weights are good, their NRMSE is not a finite number."""
    x, _ = problem(0)
    fit = solve(x, np.full((60, 1), 3.0), bias=True)
    assert fit.w_out[:, 0] == pytest.approx([*[0.0] * 7, 3.0], abs=1e-13)
    assert not np.isfinite(fit.train_nrmse)


@given(seed=seeds)
def test_ridge_of_rows_s_squared_acts_like_length_noise(seed):
    """In the mean over many samples of noise with standard deviation s."""
    x, y = problem(seed, rows=50, columns=4)
    s, copies = 0.5, 400
    rng = np.random.default_rng(seed)
    noisy = np.tile(x, (copies, 1)) + s * rng.normal(size=(50 * copies, 4))
    noise = fit_readout(noisy, np.tile(y, (copies, 1)))
    assert np.abs(noise - fit_readout(x, y, 50 * s**2)).max() < 0.1
    assert np.abs(noise - fit_readout(x, y)).max() > 0.02


@pytest.mark.parametrize(
    ("x", "y", "ridge", "name"),
    [
        (np.ones((5, 2)), np.ones((4, 1)), 0.0, "targets"),
        (np.ones(5), np.ones((5, 1)), 0.0, "lengths"),
        (np.ones((5, 2)), np.ones(5), 0.0, "targets"),
        (np.full((5, 2), np.nan), np.ones((5, 1)), 0.0, "lengths"),
        (np.ones((5, 2)), np.full((5, 1), np.inf), 0.0, "targets"),
        (np.ones((5, 2)), np.ones((5, 1)), -1.0, "ridge"),
        (np.ones((5, 2)), np.ones((5, 1)), np.nan, "ridge"),
        (np.ones((0, 2)), np.ones((0, 1)), 0.0, "lengths"),
    ],
)
def test_wrong_data_are_named(x, y, ridge, name):
    with pytest.raises(InvalidArgumentError) as caught:
        fit_readout(x, y, ridge)
    assert caught.value.name == name


def test_chunks_must_have_the_same_width():
    regression = Regression()
    regression.add(np.ones((5, 2)), np.ones((5, 1)))
    with pytest.raises(InvalidArgumentError, match="lengths: expected 2 columns, got 3"):
        regression.add(np.ones((5, 3)), np.ones((5, 1)))
    with pytest.raises(InvalidArgumentError, match="targets: expected "):
        regression.add(np.ones((5, 2)), np.ones((5, 2)))
    with pytest.raises(InvalidArgumentError, match="at least one sample"):
        Regression().solve()
