"""Practice: what is fed back and fitted, when it ends, and that it helps."""

from dataclasses import replace

import numpy as np
import pytest
import twins

from mcmj import Simulation, Teaching, random_body, teach
from mcmj.learning.lessons import Lesson
from mcmj.learning.practice import Exercise, Practice, practise, practise_exercises
from mcmj.learning.teaching import Course, lessons_of
from mcmj.metrics.orbits import orbit_error
from mcmj.targets.limit_cycles import target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.seeds import stream

STEP = 2e-3
TAUGHT = Teaching(duration=20.0, washout=5.0, rest_runs=1, away_duration=5.0, noise=0.1)
SHORT = Practice(rounds=2, round_runs=1, round_duration=5.0, trial=15.0, trial_window=12.0)


@pytest.fixture(scope="module")
def goal():
    return target("quadratic")


def test_a_lesson_mixes_the_bodys_own_outputs_into_what_is_fed_back(body, w_out, goal):
    """The same regression from the twin, driven by s y + (1 - s) y* + noise, and NumPy."""
    simulation = Simulation(body, timestep=STEP, w_out=w_out, integrator="Euler")
    course = Course(simulation, replace(TAUGHT, ridge_per_row=1e-6), seed=3)
    simulation.rollout(100, record=())
    before = simulation.state
    course.attend(Lesson(goal.sample, 3.0, 1.0, from_rest=True, own_share=0.6, weight=0.5))
    assert np.array_equal(simulation.state.positions, before.positions)
    assert simulation.time == before.time
    fit = course.fit()
    clean = goal.sample(STEP * np.arange(1500))
    noise = 0.1 * stream(3, "rest_noise").standard_normal(clean.shape)
    driven = twins.run(body, 1500, timestep=STEP, w_out=w_out, gate=0.6, offset=0.4 * clean + noise)
    x, y = driven.lengths[500:], clean[500:]
    penalty = np.sqrt(1e-6 * len(x)) * np.eye(body.n_springs)
    w = np.linalg.lstsq(np.vstack([x, penalty]), np.vstack([y, 0 * y[: len(penalty)]]))[0]
    assert np.abs(x @ (fit.w_out - w)).max() < 1e-6


def test_a_lesson_that_blows_up_leaves_no_trace(body, w_out, goal):
    simulation = Simulation(body, timestep=STEP, w_out=1e7 * w_out)
    course = Course(simulation, TAUGHT, seed=0)
    course.attend(Lesson(goal.sample, 5.0))
    first, time = course.fit(), simulation.time
    simulation.set_readout(1e7 * w_out)
    with pytest.raises(DivergenceError):
        course.attend(Lesson(goal.sample, 60.0, from_rest=True, own_share=1.0))
    assert simulation.time == time
    assert course.fit().w_out.tobytes() == first.w_out.tobytes()


def taught_course(goal, teaching=TAUGHT, **options):
    simulation = Simulation(random_body(0, nodes=12), timestep=STEP, engine="twin", **options)
    course = Course(simulation, teaching, seed=1)
    course.attend_all(lessons_of(goal, teaching))
    return course


def test_without_rounds_practice_is_teaching(goal):
    plain = Simulation(random_body(0, nodes=12), timestep=STEP, engine="twin")
    fit = teach(plain, goal, TAUGHT, seed=1)
    course = taught_course(goal)
    practised = practise(course, goal, replace(SHORT, rounds=0))
    assert practised.fit.w_out.tobytes() == fit.w_out.tobytes()
    assert len(practised.errors) == 1
    assert np.array_equal(course.simulation.state.positions, plain.state.positions)
    assert course.simulation.time == plain.time


def test_the_best_round_is_kept_and_its_error_is_that_of_a_run_from_rest(goal):
    course = taught_course(goal)
    practised = practise(course, goal, replace(SHORT, good_enough=1e-9))
    assert len(practised.errors) == 3
    course.simulation.reset()
    outputs = course.simulation.rollout(7500, record=("outputs",)).outputs[-6000:]
    assert orbit_error(outputs, goal) == min(practised.errors)
    assert np.array_equal(course.simulation.w_out, practised.fit.w_out)


def test_other_starts_are_tried_too_and_the_worst_counts(goal):
    """From a snapshot in motion, judged by the largest output instead."""
    course = taught_course(goal)
    start = course.simulation.snapshot()
    practised = practise(
        course, goal, replace(SHORT, rounds=1, good_enough=1e-9), starts=[start],
        judge=lambda outputs: float(np.abs(outputs).max()),
    )  # fmt: skip
    largest = []
    for begin in (course.simulation.reset, lambda: course.simulation.restore(start)):
        begin()
        outputs = course.simulation.rollout(7500, record=("outputs",)).outputs[-6000:]
        largest.append(np.abs(outputs).max())
    assert min(practised.errors) == max(largest)


def test_exercises_are_tried_under_their_inputs(goal):
    """An input that grows with time, from a snapshot in motion; each judged by its own measure."""
    simulation = Simulation(random_body(0, nodes=12, n_inputs=1), timestep=STEP, engine="twin")
    course = Course(simulation, TAUGHT, seed=1)
    course.attend_all(lessons_of(goal, TAUGHT))
    start, first = simulation.snapshot(), round(simulation.time / STEP)
    lesson = Lesson(goal.sample, 5.0, inputs=lambda times: times[:, None] / 40, start=start)
    exercises = [Exercise(lesson, lambda outputs, c=c: np.abs(outputs[:, c]).max()) for c in (0, 1)]
    practised = practise_exercises(course, exercises, replace(SHORT, rounds=1, good_enough=1e-9))
    assert simulation.time == pytest.approx(STEP * first)
    outputs = simulation.rollout(inputs=STEP * np.arange(first, first + 7500)[:, None] / 40).outputs
    assert np.abs(outputs[-6000:]).max() == min(practised.errors)


def test_practice_ends_when_it_is_good_enough(goal):
    assert len(practise(taught_course(goal), goal, replace(SHORT, good_enough=9.9)).errors) == 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rounds", -1),
        ("round_runs", 0),
        ("round_duration", 0.0),
        ("round_weight", np.nan),
        ("own_shares", ()),
        ("own_shares", (0.5, 1.5)),
        ("trial_window", 100.0),
        ("good_enough", 0.0),
    ],
)
def test_bad_settings_are_named(name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Practice(**{name: value})
    assert caught.value.name == name


@pytest.mark.slow
def test_practice_makes_a_body_swing_up_that_teaching_alone_does_not():
    """Seed 10: Van der Pol from rest ends elsewhere after teaching alone."""
    goal = target("van_der_pol")
    taught = Teaching(duration=120.0, rest_runs=2)
    course = Course(Simulation(random_body(10), engine="twin"), taught, seed=0)
    course.attend_all(lessons_of(goal, taught))
    practised = practise(course, goal, Practice())
    assert practised.errors[0] > 0.05 > 0.02 > min(practised.errors)
