"""Teacher forcing: the target is fed back in place of the outputs, and the readout is fitted."""

from collections.abc import Iterable
from copy import copy

import numpy as np

from mcmj.learning.lessons import HELD, HELD_SIZE, Lesson, TeacherNoise, Teaching
from mcmj.learning.regression import Fit, Regression
from mcmj.metrics.orbits import ORBIT_POINTS
from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array


def teach(
    simulation: Reservoir,
    target: Target,
    teaching: Teaching,
    seed: int,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Fit:
    """Teach a target by teacher forcing, then close the loop with the readout.

    The teacher runs on from the simulation's time, so that afterwards the target's value at
    `simulation.time` is still what the body should do. Memory does not grow with duration.

    Args:
        simulation: a body, or any reservoir; afterwards its readout is the fitted one.
        seed: of the noise streams.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
        InvalidArgumentError: the target has other outputs, or there are copies.
    """
    require_outputs(simulation, target, "simulation")
    return teach_lessons(
        simulation, lessons_of(target, teaching), teaching, seed, on_steps=on_steps
    )


def teach_lessons(
    simulation: Reservoir,
    lessons: Iterable[Lesson],
    teaching: Teaching,
    seed: int,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Fit:
    """One readout fitted to several lessons together; the simulation then runs it.

    Args:
        teaching: noise, ridge and bias; durations are the lessons' own.
        seed, on_steps: as for `teach`.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    course = Course(simulation, teaching, seed)
    course.attend_all(lessons, on_steps=on_steps)
    return course.fit()


def lessons_of(target: Target, teaching: Teaching) -> list[Lesson]:
    """What `teaching` asks for: the runs from rest and where it was held, the one on the cycle."""
    duration, weight = teaching.away_duration, teaching.away_weight
    from_rest = Lesson(target.sample, duration, weight=weight, from_rest=True)
    held = [
        Lesson(target.sample, HELD + duration, HELD, weight=weight, held=outputs)
        for outputs in held_outputs(target, teaching.held_runs)
    ]
    on_cycle = Lesson(target.sample, teaching.duration, teaching.washout)
    return [*[from_rest] * teaching.rest_runs, *held, on_cycle]


def held_outputs(target: Target, count: int) -> Array:
    """Constants (count, n_outputs), evenly over the box of HELD_SIZE times the largest outputs."""
    from scipy.stats.qmc import Halton  # takes a second to import

    largest = np.abs(target.orbit(ORBIT_POINTS)).max(axis=0)
    places = Halton(target.n_outputs, scramble=False).random(count + 1)[1:]  # the first is a corner
    found: Array = HELD_SIZE * largest * (2.0 * places - 1.0)
    return found


class Course:
    """A body being taught: lessons are folded in one by one, a readout fitted at any time.

    Args:
        simulation: the body; its state carries over from lesson to lesson.
        teaching: noise, ridge and bias; durations are the lessons' own.
        seed: of the noise streams.
    """

    def __init__(self, simulation: Reservoir, teaching: Teaching, seed: int) -> None:
        if simulation.copies is not None:
            raise InvalidArgumentError("simulation", "one without copies", simulation.copies)
        self.simulation, self._teaching = simulation, teaching
        self._regression = Regression(bias=teaching.bias)
        self._noise = stream(seed, "teacher_noise")
        self._rest_noise = stream(seed, "rest_noise")
        self._length_noise = stream(seed, "length_noise")

    @property
    def regression(self) -> Regression:
        """Of all lessons so far: it serves any ridge."""
        return self._regression

    def fit(self) -> Fit:
        """The readout that serves all lessons so far best; the simulation runs it from now on."""
        ridge = self._teaching.ridge_per_row * self._regression.weight
        fit = self._regression.solve(ridge=ridge)
        self.simulation.set_readout(fit.w_out)
        return fit

    def attend_all(
        self, lessons: Iterable[Lesson], *, on_steps: OnSteps = lambda steps: None
    ) -> None:
        """One lesson after the other; see `attend`."""
        for lesson in lessons:
            self.attend(lesson, on_steps=on_steps)

    def attend(self, lesson: Lesson, *, on_steps: OnSteps = lambda steps: None) -> None:
        """Run a lesson and fold it in; memory does not grow with its duration.

        Raises:
            DivergenceError: the body blew up; nothing of the lesson is then folded in.
            InvalidArgumentError: a share of its own outputs for a body that has no readout, or
                shares of the noise for other than its outputs.
        """
        if np.size(lesson.noise_share) not in (1, self.simulation.n_outputs):
            raise InvalidArgumentError(
                "noise_share", f"1 or {self.simulation.n_outputs} numbers", lesson.noise_share
            )
        if lesson.own_share > 0 and self.simulation.w_out is None:
            raise InvalidArgumentError("own_share", "0 before the first fit", lesson.own_share)
        before = self.simulation.snapshot()
        lesson.begin(self.simulation)
        learnt = copy(self._regression)
        try:
            self._follow(lesson, learnt, on_steps)
        finally:
            if lesson.elsewhere:
                self.simulation.restore(before)
        self._regression = learnt

    def _follow(self, lesson: Lesson, regression: Regression, on_steps: OnSteps) -> None:
        step = self.simulation.timestep
        total, washout = round(lesson.duration / step), round(lesson.washout / step)
        first = round(self.simulation.time / step)
        noise = self._noise_of(lesson)
        for start in range(0, total, CHUNK):
            steps = np.arange(start, min(start + CHUNK, total))
            times = step * (first + steps).astype(np.float64)
            clean = lesson.outputs(times)
            fed = clean.copy()
            if lesson.held is not None:
                fed[steps < washout] = lesson.held
            signals = self._signals(lesson, times, fed, noise.take(len(steps)))
            every = self._teaching.every
            earliest = -(-max(start, washout) // every) * every
            learned = slice(earliest - start, None, every)
            if earliest < start + len(steps):
                weight = lesson.weight
                weights = weight(times[learned]) if callable(weight) else weight
                regression.add(signals[learned], clean[learned], weight=weights)
            on_steps(len(steps))

    def _noise_of(self, lesson: Lesson) -> TeacherNoise:
        """Of the outputs that have a share of it: the others draw nothing from the stream."""
        generator = self._rest_noise if lesson.elsewhere else self._noise
        loud = int((np.broadcast_to(lesson.noise_share, self.simulation.n_outputs) > 0).sum())
        return TeacherNoise(self._teaching, generator, loud, self.simulation.timestep)

    def _signals(self, lesson: Lesson, times: Array, fed: Array, noise: Array) -> Array:
        """Signals (T, n_signals) under the teacher, as the readout hears them."""
        noisy = (1.0 - lesson.own_share) * fed
        share = np.broadcast_to(lesson.noise_share, fed.shape[1])
        loud = share > 0
        noisy[:, loud] += share[loud] * noise
        run = self.simulation.rollout(
            inputs=None if lesson.inputs is None else lesson.inputs(times),
            offset=noisy,
            gate=lesson.own_share,
            record=("signals",),
        )
        signals = run.get("signals")
        if self._teaching.length_noise > 0:
            seen = self._length_noise.standard_normal(signals.shape)
            signals = signals + self._teaching.length_noise * seen
        return signals


def synchronise(
    simulation: Reservoir, target: Target, duration: float, inputs: object = None
) -> None:
    """Bring a body onto the target by clean teacher forcing, without learning.

    Args:
        duration: [s].
        inputs: (n_inputs,) held meanwhile; default: 0.
    """
    step = simulation.timestep
    steps = round(simulation.time / step) + np.arange(round(duration / step))
    held = None if inputs is None else np.tile(np.asarray(inputs, np.float64), (len(steps), 1))
    simulation.rollout(inputs=held, offset=target.sample(steps * step), gate=0.0, record=())
