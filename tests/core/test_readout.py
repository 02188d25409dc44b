"""A readout is one thing in all its forms; oracles: the sum written out, in fractions."""

from fractions import Fraction

import numpy as np
import pytest

import mcmj
from mcmj.core.readout import Readout, checked_readout, is_pair, readout_rows
from mcmj.reference.integration import integrate
from mcmj.simulation.ensemble import Ensemble
from mcmj.utils.errors import InvalidArgumentError

N, C = 5, 2


@pytest.fixture
def weights():
    return np.random.default_rng(0).normal(size=(N, C))


@pytest.fixture
def bias():
    return np.array([0.3, -0.7])


def exact(weights, bias, signals):
    """y_c = b_c + sum_j W_jc s_j of one row, without rounding until the end."""
    return [
        float(Fraction(b) + sum(Fraction(w) * Fraction(s) for w, s in zip(column, signals)))  # noqa: B905
        for column, b in zip(weights.T, bias)  # noqa: B905
    ]


def test_all_forms_are_the_same_readout(weights, bias):
    rows = np.vstack([weights, bias])
    for value in (rows, rows.tolist(), (weights, bias), Readout(weights, bias)):
        readout = Readout.of(value, N, C)
        assert np.array_equal(readout.weights, weights)
        assert np.array_equal(readout.bias, bias)
        assert np.array_equal(readout.rows, rows)
        assert np.array_equal(readout_rows(value, N, C), rows)


def test_without_a_bias_it_is_zero_and_arrays_stay_as_they_are(weights):
    readout = Readout.of(weights, N, C)
    assert np.array_equal(readout.bias, np.zeros(C))
    assert np.array_equal(readout_rows(weights, N, C), weights)


def test_none_always_says_zero():
    readout = Readout.of(None, N, C)
    assert np.array_equal(readout.outputs(np.arange(15.0).reshape(3, N)), np.zeros((3, C)))


def test_outputs_are_the_weighted_sum(weights, bias):
    readout = Readout.of((weights, bias), N, C)
    signals = np.random.default_rng(1).normal(size=(2, 3, N))
    wanted = np.array([[exact(weights, bias, row) for row in part] for part in signals])
    assert readout.outputs(signals) == pytest.approx(wanted, abs=1e-14)
    assert readout.outputs(signals[0, 0]) == pytest.approx(wanted[0, 0], abs=1e-14)
    assert readout.outputs_by_row(signals) == pytest.approx(wanted, abs=1e-14)
    assert readout.weighted(signals[0]) + bias == pytest.approx(wanted[0], abs=1e-14)


def test_rows_keep_their_bits_whatever_is_beside_them(weights, bias):
    n = 83
    draw = np.random.default_rng(2)
    readout = Readout(draw.normal(size=(n, C)), bias)
    signals = draw.normal(size=(1001, n))
    for function in (readout.outputs_by_row, readout.weighted):
        together = function(signals)
        for first, last in ((0, 1), (1, 4), (500, 1001)):
            alone = function(signals[first:last])
            assert np.array_equal(together[first:last] + 0.0, alone + 0.0)


def test_copies_have_readouts_of_their_own(weights, bias):
    rows = np.stack([np.vstack([weights, bias]), np.vstack([2 * weights, 3 * bias])])
    signals = np.random.default_rng(3).normal(size=(2, 4, N))
    readouts = Readout.from_rows(rows, N)
    assert np.array_equal(readouts.rows, rows)
    both = readouts.outputs_by_row(signals)
    for copy in range(2):
        alone = Readout.of(rows[copy], N, C).outputs_by_row(signals[copy])
        assert np.array_equal(both[copy], alone)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.zeros((N + 2, C)), r"5 rows \(or 6 with a bias\), got shape \(7, 2\)"),
        (np.zeros((N, C + 1)), r"shape \(any, 2\), got shape \(5, 3\)"),
        (np.zeros(N), r"shape \(any, 2\), got shape \(5,\)"),
        (np.full((N, C), np.nan), "finite numbers, got nan"),
        ((np.zeros((N, C)), np.zeros(C + 1)), r"shape \(2\), got shape \(3,\)"),
        ((np.zeros((N + 1, C)), np.zeros(C)), r"shape \(5, 2\), got shape \(6, 2\)"),
        ((np.zeros((N, C)), np.array([0.0, np.inf])), "finite numbers, got inf"),
        (Readout(np.zeros((N, C + 1)), np.zeros(C + 1)), r"shape \(any, 2\)"),
        ("weights", r"numbers of shape \(any, 2\)"),
    ],
)
def test_errors_name_the_argument(value, message):
    with pytest.raises(InvalidArgumentError, match=f"gait: expected {message}"):
        Readout.of(value, N, C, "gait")


def test_two_copies_are_not_a_pair(weights, bias):
    assert is_pair((weights, bias))
    assert not is_pair((weights, weights))
    assert not is_pair([weights, bias])


def test_simulations_take_every_form(body, w_out, w_bias):
    n = body.n_springs
    forms = (w_bias, (w_bias[:n], w_bias[n]), Readout(w_bias[:n], w_bias[n]))
    euler = {"integrator": "Euler"}
    wanted = mcmj.Simulation(body, w_out=w_bias, **euler).rollout(20).outputs
    for form in forms:
        assert np.array_equal(checked_readout(body, form), w_bias)
        again = mcmj.Simulation(body, w_out=form, **euler).rollout(20).outputs
        assert np.array_equal(again, wanted)
        copies = Ensemble(body, copies=2, w_out=form, **euler).rollout(20).outputs
        assert np.array_equal(copies, np.stack([wanted, wanted]))
        run = integrate(body, method="semi_implicit_euler", steps=20, w_out=form)
        assert np.abs(run.outputs - wanted).max() < 1e-11
    both = Ensemble(body, copies=2, w_out=(w_out, 2 * w_out)).rollout(1).outputs
    assert np.array_equal(both[1], 2 * both[0])
