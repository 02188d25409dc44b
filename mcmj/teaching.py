"""Teacher forcing: the target is fed back in place of the outputs, and the readout is fitted."""

from collections.abc import Callable, Sequence
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
        ridge_per_row: ridge parameter over the number of rows; s^2 does what a length noise
            of s would, without randomness.
        bias: fit a constant too (the paper's readout has none).
        rest_runs: number of runs taught from total rest, without washout, beside the one
            above; they teach the body to swing up.
        rest_duration: of each of them [s]; the target starts at time 0 at full size.
        rest_weight: of their squared errors, against 1. Tiny, for a linear readout cannot
            serve both well: at 0.01 it already loses the cycle.
    """

    duration: float = 120.0
    washout: float = 20.0
    noise: float = 0.2
    length_noise: float = 0.0
    ridge_per_row: float = 0.0
    bias: bool = False
    rest_runs: int = 0
    rest_duration: float = 12.0
    rest_weight: float = 1e-3

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_number("washout", self.washout, 0.0)
        if self.washout >= self.duration:
            raise InvalidArgumentError(
                "washout", f"less than the duration of {self.duration:g} s", self.washout
            )
        for name in ("noise", "length_noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        require_count("rest_runs", self.rest_runs, 0)
        for name in ("rest_duration", "rest_weight"):
            require_number(name, getattr(self, name), 0.0, open_low=True)


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
    """

    outputs: Signal
    duration: float
    washout: float = 0.0
    inputs: Signal | None = None
    weight: float | Signal = 1.0
    from_rest: bool = False


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
    start = Lesson(
        target.sample, teaching.rest_duration, weight=teaching.rest_weight, from_rest=True
    )
    cycle = Lesson(target.sample, teaching.duration, teaching.washout)
    lessons = [*[start] * teaching.rest_runs, cycle]
    return teach_lessons(simulation, lessons, teaching, seed, on_steps=on_steps)


def teach_lessons(
    simulation: Simulation,
    lessons: Sequence[Lesson],
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
    noises = {name: stream(seed, name) for name in ("teacher_noise", "rest_noise", "length_noise")}
    regression = Regression(bias=teaching.bias)
    for lesson in lessons:
        before = simulation.snapshot()
        if lesson.from_rest:
            simulation.reset()
        _follow(simulation, lesson, teaching, noises, regression, on_steps)
        if lesson.from_rest:
            simulation.restore(before)
    fit = regression.solve(ridge=teaching.ridge_per_row * regression.weight)
    simulation.set_readout(fit.w_out)
    return fit


def _follow(
    simulation: Simulation,
    lesson: Lesson,
    teaching: Teaching,
    noises: dict[str, np.random.Generator],
    regression: Regression,
    on_steps: OnSteps,
) -> None:
    """Fold a lesson into the regression."""
    step = simulation.timestep
    total, washout = round(lesson.duration / step), round(lesson.washout / step)
    first = round(simulation.time / step)
    noise = noises["rest_noise" if lesson.from_rest else "teacher_noise"]
    for start in range(0, total, CHUNK):
        steps = np.arange(start, min(start + CHUNK, total))
        times = step * (first + steps).astype(np.float64)
        clean = lesson.outputs(times)
        noisy = clean + teaching.noise * noise.standard_normal(clean.shape)
        inputs = None if lesson.inputs is None else lesson.inputs(times)
        rollout = simulation.rollout(inputs=inputs, offset=noisy, gate=0.0, record=("lengths",))
        lengths = rollout.get("lengths")
        if teaching.length_noise > 0:
            seen = noises["length_noise"].standard_normal(lengths.shape)
            lengths = lengths + teaching.length_noise * seen
        learned = steps >= washout
        if learned.any():
            weight = lesson.weight
            weights = weight(times[learned]) if callable(weight) else weight
            regression.add(lengths[learned], clean[learned], weight=weights)
        on_steps(len(steps))


def synchronise(simulation: Simulation, target: Target, duration: float) -> None:
    """Bring a body onto the target by clean teacher forcing, without learning."""
    step = simulation.timestep
    steps = round(simulation.time / step) + np.arange(round(duration / step))
    simulation.rollout(offset=target.sample(steps * step), gate=0.0, record=())
