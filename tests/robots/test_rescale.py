"""A body in other units moves the same: a symmetry of the equations of motion, to the bit."""

import numpy as np
import pytest

import mcmj
from mcmj.robots.rescale import rescaled, rescaled_readout

STEP, STEPS = 1e-3, 3000


def run(body, w_out, step, offset):
    simulation = mcmj.Simulation(body, w_out=w_out, timestep=step)
    return simulation.rollout(offset=offset, record=("lengths", "outputs", "velocities"))


@pytest.fixture
def offset(body):
    rng = np.random.default_rng(4)
    return np.sin(np.linspace(0, 9, STEPS))[:, None] * rng.normal(size=body.n_outputs)


@pytest.mark.parametrize("pace", [4.0, 0.5])
def test_powers_of_two_change_no_bit(body, w_bias, offset, pace):
    plain = run(body, w_bias, STEP, offset)
    size, mass = 0.25, 1 / 16
    other = run(
        rescaled(body, pace=pace, size=size, mass=mass),
        rescaled_readout(body, w_bias, size=size),
        STEP / pace,
        offset,
    )
    assert np.ptp(plain.outputs, axis=0).min() > 0.03  # it moves
    assert np.array_equal(other.lengths, size * plain.lengths)
    assert np.array_equal(other.velocities, size * pace * plain.velocities)
    assert np.array_equal(other.outputs, plain.outputs)


def test_any_factor_is_the_same_to_rounding(body, w_bias, offset):
    plain = run(body, w_bias, STEP, offset)
    other = run(
        rescaled(body, pace=6.7, size=0.013, mass=0.3),
        rescaled_readout(body, w_bias, size=0.013),
        STEP / 6.7,
        offset,
    )
    assert np.abs(other.outputs - plain.outputs).max() < 1e-10


def test_factors_undo_each_other(body):
    there = rescaled(body, pace=8.0, size=0.5, mass=2.0)
    assert rescaled(there, pace=0.125, size=2.0, mass=0.5) == body


@pytest.mark.parametrize("name", ["pace", "size", "mass"])
def test_factors_are_positive(body, name):
    with pytest.raises(mcmj.utils.errors.InvalidArgumentError, match=f"{name}: expected"):
        rescaled(body, **{name: 0.0})
