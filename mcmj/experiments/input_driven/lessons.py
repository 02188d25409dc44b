"""How a body learns to follow its input: the course, then practice of the jumps it misses."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from mcmj.experiments.input_driven.config import SYSTEM, Config
from mcmj.learning.lessons import Lesson
from mcmj.learning.practice import Exercise, Practised, practise_exercises
from mcmj.learning.teaching import Course
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.input_profiles import Profile, hold
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array


def course_lesson(config: Config) -> Lesson:
    """The course, with the target's way along it; the same for every body."""
    course = config.course
    return Lesson(
        SYSTEM.follow(course),
        course.duration,
        config.run_in,
        inputs=lambda times: course(times)[:, None],
    )


def teach(
    config: Config, simulation: Simulation, lesson: Lesson, seed: int, on_steps: OnSteps
) -> Practised:
    """Attend the course, then practise the jumps; the simulation is left where the course ends.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    course = Course(simulation, config.teaching, seed)
    course.attend(lesson, on_steps=on_steps)
    end = simulation.snapshot()
    jumps = []
    for state in _states(config, simulation, lesson):
        jumps += [_jump(config, simulation, state, value) for value in config.inputs]
    simulation.restore(end)
    return practise_exercises(course, jumps, config.practice, on_steps=on_steps)


def _states(config: Config, simulation: Simulation, lesson: Lesson) -> Iterator[Array]:
    """The target's states to jump from, while the teacher leads the body through them."""
    last, step = config.course.last, simulation.timestep
    period = SYSTEM.cycle(last).period
    goal = lesson.outputs(np.array([lesson.duration]))[0]
    path = SYSTEM.follow(Profile([hold(last, period)]), goal)
    steps = round(period / config.phases / step)
    for phase in range(config.phases):
        yield path(np.array([phase * steps * step]))[0]
        times = step * (phase * steps + np.arange(steps, dtype=np.float64))
        if phase + 1 < config.phases:
            inputs = np.full((steps, 1), last)
            simulation.rollout(inputs=inputs, offset=path(times), gate=0.0, record=())


def _jump(config: Config, simulation: Simulation, state: Array, value: float) -> Exercise:
    """From here the input is constant, and the target goes on from its state under it."""
    duration, start = config.practice.round_duration, simulation.time
    path = SYSTEM.follow(Profile([hold(value, duration)]), state)
    lesson = Lesson(
        lambda times: path(times - start),
        duration,
        inputs=lambda times: np.full((len(times), 1), value),
        start=simulation.snapshot(),
    )
    return Exercise(lesson, partial(orbits.orbit_error, target=SYSTEM.cycle(value)))
