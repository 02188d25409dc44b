"""Ridge and teacher noise by what the closed loop does from starts it has not seen."""

from dataclasses import replace

import numpy as np
import pytest

import mcmj
from mcmj.learning.choose_noise import select_teaching
from mcmj.learning.held_out import closed_loop_errors, held_out_starts
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise, teach
from mcmj.metrics.orbits import orbit_error
from mcmj.utils.errors import DivergenceError

GOAL = mcmj.target("quadratic")
TEACHING = Teaching(duration=50.0)
NOISES, RIDGES = (0.0, 0.2), (0.0, 1e-7, 1e-2)


@pytest.fixture(scope="module")
def body():
    return mcmj.random_body(3, 20)


@pytest.fixture(scope="module")
def choice(body):
    simulation = mcmj.Simulation(body, engine="twin")
    return select_teaching(
        simulation, GOAL, TEACHING, 0, noises=NOISES, ridges_per_row=RIDGES, starts=3
    )


def test_the_choice_is_not_that_of_the_training_error(choice):
    """Without noise the training error is smallest, and the loop drifts off."""
    trained = np.unravel_index(choice.train_nrmse.argmin(), choice.train_nrmse.shape)
    assert trained == (0, 0)
    assert choice.errors[trained] > 0.05
    assert choice.errors.min() < 0.02
    assert choice.teaching.noise == 0.2
    assert replace(choice.teaching, noise=0.2, ridge_per_row=0.0) == TEACHING
    i, j = NOISES.index(choice.teaching.noise), RIDGES.index(choice.teaching.ridge_per_row)
    assert choice.errors[i, j] == choice.errors.min()


def test_the_readout_is_what_teach_gives_with_the_choice(body, choice):
    simulation = mcmj.Simulation(body, engine="twin")
    fit = teach(simulation, GOAL, choice.teaching, 0)
    assert np.array_equal(fit.w_out, choice.w_out)


def test_the_errors_hold_from_a_start_of_another_kind(body, choice):
    simulation = mcmj.Simulation(body)  # MuJoCo
    synchronise(simulation, GOAL, 33.3)
    simulation.set_readout(choice.w_out)
    outputs = simulation.rollout(40_000, record=("outputs",)).get("outputs")
    assert orbit_error(outputs[-20_000:], GOAL) == pytest.approx(choice.errors.min(), rel=0.05)


def test_starts_are_different_moments_of_a_noisy_lesson(body):
    simulation = mcmj.Simulation(body, engine="twin")
    starts = held_out_starts(simulation, GOAL, TEACHING, 5, 4)
    times, states = [], []
    for start in starts:
        simulation.restore(start)
        times.append(simulation.time)
        states.append(simulation.state.positions)
    phases = np.mod(times, GOAL.period) / GOAL.period
    gaps = np.diff(np.sort(phases))
    assert np.allclose(gaps, 0.25, atol=0.01)
    for one in range(4):
        for other in range(one):
            assert np.abs(states[one] - states[other]).max() > 1e-3
    again = held_out_starts(simulation, GOAL, TEACHING, 5, 4)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(starts, again, strict=True))


def test_a_run_that_blows_up_has_an_infinite_error(body):
    simulation = mcmj.Simulation(body, engine="twin")
    starts = held_out_starts(simulation, GOAL, TEACHING, 0, 2)
    wild = np.full((body.n_springs, 2), 1e6)
    errors = closed_loop_errors(simulation, wild, starts, GOAL, free_run=13.0, window=12.0)
    assert np.isinf(errors).all()


def test_a_body_that_cannot_be_taught_says_so():
    wild = mcmj.random_body(3, 20, feedback_scale=1e5)
    simulation = mcmj.Simulation(wild, engine="twin")
    with pytest.raises(DivergenceError):
        select_teaching(simulation, GOAL, Teaching(duration=20.0, washout=1.0), 0, noises=(0.2,))
