"""Teacher forcing: the target is fed back in place of the outputs, and the readout is fitted."""

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass

import numpy as np

from mcmj.errors import InvalidArgumentError
from mcmj.progress import OnSteps
from mcmj.readout import Fit, Regression
from mcmj.simulation import CHUNK, Simulation
from mcmj.streams import stream
from mcmj.targets import Target
from mcmj.validation import Array, require_count, require_number

Signal = Callable[[Array], Array]  # times (T,) [s] -> (T, n)


@dataclass(frozen=True)
class Teaching:
    """How a readout is taught.

    Attributes:
        duration: teacher forcing, washout included [s].
        washout: start of it that the regression leaves out [s].
        noise: standard deviation of the white noise on the fed-back teacher signal (units of
            the output); the regression target stays clean. Without it the free run drifts off.
        length_noise: standard deviation of white noise on the lengths the readout sees [m].
        ridge_per_row: ridge parameter over the number of rows (the sum of their weights); s^2
            does what a length noise of s would, without randomness.
        bias: fit a constant too (the paper's readout has none).
        every: the regression takes every n-th step only: neighbours at 1 ms are nearly equal.
        rest_runs: number of runs taught from total rest, without washout, beside the one
            above; they teach the body to swing up.
        rest_duration: of each of them [s]; the target starts at time 0 at full size.
        rest_weight: of their squared errors, against 1. Small, for a linear readout cannot
            serve both well.
    """

    duration: float = 120.0
    washout: float = 20.0
    noise: float = 0.2
    length_noise: float = 0.0
    ridge_per_row: float = 0.0
    bias: bool = False
    every: int = 1
    rest_runs: int = 0
    rest_duration: float = 12.0
    rest_weight: float = 1e-3

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_washout(self.washout, self.duration)
        for name in ("noise", "length_noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        require_count("every", self.every, 1)
        require_count("rest_runs", self.rest_runs, 0)
        for name in ("rest_duration", "rest_weight"):
            require_number(name, getattr(self, name), 0.0, open_low=True)

    @property
    def total(self) -> float:
        """Of all runs together [s]."""
        return self.duration + self.rest_runs * self.rest_duration


def require_washout(washout: float, duration: float) -> None:
    """Raise unless 0 <= washout < duration [s]."""
    require_number("washout", washout, 0.0)
    if washout >= duration:
        raise InvalidArgumentError("washout", f"less than the duration of {duration:g} s", washout)


@dataclass(frozen=True)
class Lesson:
    """A stretch of teacher forcing: what is fed back, and what the readout is to say then.

    Signals are functions of the simulation's time, which is 0 where a lesson starts from rest.

    Attributes:
        outputs: times (T,) [s] -> (T, n_outputs).
        duration: washout included [s].
        washout: start of it that the regression leaves out [s].
        inputs: times (T,) [s] -> (T, n_inputs); None: no input.
        weight: of the squared errors, a number or times (T,) [s] -> (T,).
        from_rest: begin at total rest and time 0, and leave the simulation as it was.
        start: begin at this snapshot of the simulation, and leave it as it was.
        own_share: s in [0, 1]: s y + (1 - s) y* + noise is fed back, y the body's own outputs.
    """

    outputs: Signal
    duration: float
    washout: float = 0.0
    inputs: Signal | None = None
    weight: float | Signal = 1.0
    from_rest: bool = False
    start: Array | None = None
    own_share: float = 0.0

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_washout(self.washout, self.duration)
        require_number("own_share", self.own_share, 0.0, 1.0)
        if self.from_rest and self.start is not None:
            raise InvalidArgumentError("start", "None for a lesson from rest", "a snapshot")

    @property
    def elsewhere(self) -> bool:
        """Whether it begins where the simulation is not."""
        return self.from_rest or self.start is not None

    def begin(self, simulation: Simulation) -> None:
        """Put a simulation where the lesson begins."""
        if self.from_rest:
            simulation.reset()
        if self.start is not None:
            simulation.restore(self.start)


def teach(
    simulation: Simulation,
    target: Target,
    teaching: Teaching,
    seed: int,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Fit:
    """Teach a target to a body by teacher forcing, then close the loop with the readout.

    The teacher runs on from the simulation's time, so that afterwards the target's value at
    `simulation.time` is still what the body should do. Memory does not grow with duration.

    Args:
        simulation: the body to teach; afterwards its readout is the fitted one.
        seed: of the noise streams.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    return teach_lessons(
        simulation, lessons_of(target, teaching), teaching, seed, on_steps=on_steps
    )


def teach_lessons(
    simulation: Simulation,
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
    """What `teaching` asks for: the runs from rest, then the one on the cycle."""
    from_rest = Lesson(
        target.sample, teaching.rest_duration, weight=teaching.rest_weight, from_rest=True
    )
    on_cycle = Lesson(target.sample, teaching.duration, teaching.washout)
    return [*[from_rest] * teaching.rest_runs, on_cycle]


class Course:
    """A body being taught: lessons are folded in one by one, a readout fitted at any time.

    Args:
        simulation: the body; its state carries over from lesson to lesson.
        teaching: noise, ridge and bias; durations are the lessons' own.
        seed: of the noise streams.
    """

    def __init__(self, simulation: Simulation, teaching: Teaching, seed: int) -> None:
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
            InvalidArgumentError: a share of its own outputs for a body that has no readout.
        """
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
        for start in range(0, total, CHUNK):
            steps = np.arange(start, min(start + CHUNK, total))
            times = step * (first + steps).astype(np.float64)
            clean = lesson.outputs(times)
            lengths = self._lengths(lesson, times, clean)
            learned = (steps >= washout) & (steps % self._teaching.every == 0)
            if learned.any():
                weight = lesson.weight
                weights = weight(times[learned]) if callable(weight) else weight
                regression.add(lengths[learned], clean[learned], weight=weights)
            on_steps(len(steps))

    def _lengths(self, lesson: Lesson, times: Array, clean: Array) -> Array:
        """Lengths (T, L) under the teacher, as the readout sees them."""
        noise = self._rest_noise if lesson.elsewhere else self._noise
        noisy = (1.0 - lesson.own_share) * clean
        noisy += self._teaching.noise * noise.standard_normal(clean.shape)
        run = self.simulation.rollout(
            inputs=None if lesson.inputs is None else lesson.inputs(times),
            offset=noisy,
            gate=lesson.own_share,
            record=("lengths",),
        )
        lengths = run.get("lengths")
        if self._teaching.length_noise > 0:
            seen = self._length_noise.standard_normal(lengths.shape)
            lengths = lengths + self._teaching.length_noise * seen
        return lengths


def synchronise(
    simulation: Simulation, target: Target, duration: float, inputs: object = None
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
