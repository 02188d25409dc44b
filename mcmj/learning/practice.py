"""Practice: a body learns to find its rhythm by itself, from rest or from another rhythm.

Under a teacher the body sees only states near the target; from elsewhere the closed loop passes
through others, and what the readout says there decides where it ends. So the teacher lets go
by degrees: a share s of what is fed back is the body's own output, s y + (1 - s) y* + noise,
and the readout is fitted again to all that was seen, the target staying y*. That is dataset
aggregation (DAgger: Ross, Gordon and Bagnell, AISTATS 2011), which, too, keeps the best of
its rounds.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from mcmj.learning.lessons import Lesson
from mcmj.learning.regression import Fit
from mcmj.learning.teaching import Course
from mcmj.metrics import orbits
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array, require_count, require_duration, require_number

Judge = Callable[[Array], float]


@dataclass(frozen=True)
class Practice:
    """How long a body practises, and what from.

    Attributes:
        rounds: at most so many, after the first fit.
        round_runs: runs in each round, from each start that does not lead home yet.
        round_duration: of each run [s]; of exercises, their lessons' own.
        round_weight: of their squared errors, against 1 for those on the cycle.
        own_shares: s of the first, second, .. round, over and over.
        trial: after every fit, a free run from every start this long [s] ..
        trial_window: .. is judged by the error of its last part [s].
        good_enough: error of the worst trial at which practice ends.
    """

    rounds: int = 18
    round_runs: int = 2
    round_duration: float = 30.0
    round_weight: float = 1e-2
    own_shares: tuple[float, ...] = (0.3, 0.6, 0.9)
    trial: float = 80.0
    trial_window: float = 20.0
    good_enough: float = 0.02

    def __post_init__(self) -> None:
        require_count("rounds", self.rounds, 0)
        require_count("round_runs", self.round_runs, 1)
        for name in ("round_weight", "good_enough"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        for name in ("round_duration", "trial"):
            require_duration(name, getattr(self, name))
        require_number("trial_window", self.trial_window, 0.0, open_low=True)
        if self.trial_window >= self.trial:
            raise InvalidArgumentError(
                "trial_window", f"less than the trial of {self.trial:g} s", self.trial_window
            )
        if not self.own_shares:
            raise InvalidArgumentError("own_shares", "at least one share", self.own_shares)
        for share in self.own_shares:
            require_number("own_shares", share, 0.0, 1.0)


@dataclass(frozen=True)
class Practised:
    """The best readout, and how practice went.

    Attributes:
        fit: of the best round; the simulation has its readout.
        errors: of the worst trial, from whatever start, after the first fit and after every
            round; infinite where it blew up.
    """

    fit: Fit
    errors: tuple[float, ...]


@dataclass(frozen=True)
class Exercise:
    """What is practised from one start.

    Attributes:
        lesson: from rest or from a snapshot; practice chooses its weight and own share.
        judge: error of the last part of a free run from there, under the lesson's inputs.
    """

    lesson: Lesson
    judge: Judge


def practise(
    course: Course,
    target: Target,
    practice: Practice,
    *,
    starts: Sequence[Array] = (),
    judge: Judge | None = None,
    on_steps: OnSteps = lambda steps: None,
) -> Practised:
    """Practise a target that a course has taught, from total rest and from other starts.

    Args:
        starts: snapshots of the simulation to start from as well, such as another rhythm.
        judge: error of the last part of a trial; default: the orbit error.
        course, practice, on_steps: as for `practise_exercises`.
    """
    judge = judge or (lambda outputs: orbits.orbit_error(outputs, target))
    duration = practice.round_duration
    lessons = [Lesson(target.sample, duration, from_rest=True)]
    lessons += [Lesson(target.sample, duration, start=start) for start in starts]
    exercises = [Exercise(lesson, judge) for lesson in lessons]
    return practise_exercises(course, exercises, practice, on_steps=on_steps)


def practise_exercises(
    course: Course,
    exercises: Sequence[Exercise],
    practice: Practice,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Practised:
    """Practise until every trial is good enough, each round those whose trial was not.

    The best round is one with the fewest such trials, of these the one whose worst error is least.
    The simulation is left where it was.

    Args:
        course: has attended its lessons; goes on with those of practice.
        on_steps: called with the number of steps done after every chunk, for progress bars.
    """
    fits, trials = [], []
    while True:
        fits.append(course.fit())
        trials.append([_trial(course.simulation, practice, e, on_steps) for e in exercises])
        if max(trials[-1]) <= practice.good_enough or len(fits) > practice.rounds:
            break
        share = practice.own_shares[(len(fits) - 1) % len(practice.own_shares)]
        for exercise, error in zip(exercises, trials[-1], strict=True):
            if error > practice.good_enough:
                lesson = replace(exercise.lesson, weight=practice.round_weight, own_share=share)
                _try_lesson(course, lesson, practice.round_runs, on_steps)
    errors = tuple(max(each) for each in trials)
    ranks = [(sum(e > practice.good_enough for e in each), max(each)) for each in trials]
    best = fits[ranks.index(min(ranks))]
    course.simulation.set_readout(best.w_out)
    return Practised(best, errors)


def _try_lesson(course: Course, lesson: Lesson, times: int, on_steps: OnSteps) -> None:
    for _ in range(times):
        with suppress(DivergenceError):  # there is nothing to learn from where it went
            course.attend(lesson, on_steps=on_steps)


def _trial(
    simulation: Reservoir, practice: Practice, exercise: Exercise, on_steps: OnSteps
) -> float:
    """Error at the end of a free run from a start; the simulation stays as it was."""
    before, step, lesson = simulation.snapshot(), simulation.timestep, exercise.lesson
    total, last = round(practice.trial / step), round(practice.trial_window / step)
    lesson.begin(simulation)
    try:
        simulation.rollout(total - last, _inputs(simulation, lesson, total - last), record=())
        inputs = _inputs(simulation, lesson, last)
        return exercise.judge(simulation.rollout(last, inputs, record=("outputs",)).get("outputs"))
    except DivergenceError:
        return float("inf")
    finally:
        simulation.restore(before)
        on_steps(total)


def _inputs(simulation: Reservoir, lesson: Lesson, steps: int) -> Array | None:
    """The lesson's inputs (steps, n_inputs) from the simulation's time on."""
    first = round(simulation.time / simulation.timestep)
    times = simulation.timestep * np.arange(first, first + steps, dtype=np.float64)
    return None if lesson.inputs is None else lesson.inputs(times)
