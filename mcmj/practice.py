"""Practice: a body learns to find its rhythm by itself, from total rest.

Under a teacher the body sees only states near the target; from rest the closed loop passes
through others, and what the readout says there decides where it ends. So the teacher lets go
by degrees: a share s of what is fed back is the body's own output, s y + (1 - s) y* + noise,
and the readout is fitted again to all that was seen, the target staying y*. That is dataset
aggregation (DAgger: Ross, Gordon and Bagnell, AISTATS 2011), which, too, keeps the best of
its rounds.
"""

from contextlib import suppress
from dataclasses import dataclass

from mcmj import metrics
from mcmj.errors import DivergenceError, InvalidArgumentError
from mcmj.progress import OnSteps
from mcmj.readout import Fit
from mcmj.simulation import Simulation
from mcmj.targets import Target
from mcmj.teaching import Course, Lesson, Teaching, lessons_of
from mcmj.validation import require_count, require_number


@dataclass(frozen=True)
class Practice:
    """How long a body practises; every run starts from total rest.

    Attributes:
        rounds: at most so many, after the first fit.
        round_runs: runs in each round.
        round_duration: of each run [s].
        round_weight: of their squared errors, against 1 for those on the cycle.
        own_shares: s of the first, second, .. round, over and over.
        trial: after every fit, a free run from rest this long [s] ..
        trial_window: .. is judged by the orbit error of its last part [s].
        good_enough: orbit error at which practice ends.
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
        for name in ("round_duration", "round_weight", "good_enough"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("trial_window", self.trial_window, 0.0, self.trial, open_low=True)
        if not self.own_shares:
            raise InvalidArgumentError("own_shares", "at least one share", self.own_shares)
        for share in self.own_shares:
            require_number("own_shares", share, 0.0, 1.0)


@dataclass(frozen=True)
class Practised:
    """The best readout, and how practice went.

    Attributes:
        fit: of the best round; the simulation has its readout.
        errors: orbit error of the trial after the first fit and after every round; infinite
            where it blew up.
    """

    fit: Fit
    errors: tuple[float, ...]


def practise(
    simulation: Simulation,
    target: Target,
    teaching: Teaching,
    practice: Practice,
    seed: int,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Practised:
    """Teach a target, then practise it from rest until a trial is good enough.

    As with `teach`, the simulation is left on the cycle, at the end of teacher forcing.

    Args:
        seed: of the noise streams.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher (in practice it may).
    """
    course = Course(simulation, teaching, seed)
    for lesson in lessons_of(target, teaching):
        course.attend(lesson, on_steps=on_steps)
    fits, errors = [course.fit()], [_trial(simulation, target, practice, on_steps)]
    while min(errors) > practice.good_enough and len(fits) <= practice.rounds:
        share = practice.own_shares[(len(fits) - 1) % len(practice.own_shares)]
        lesson = Lesson(
            target.sample, practice.round_duration, weight=practice.round_weight, from_rest=True,
            own_share=share,
        )  # fmt: skip
        for _ in range(practice.round_runs):
            _try_lesson(course, lesson, on_steps)
        fits.append(course.fit())
        errors.append(_trial(simulation, target, practice, on_steps))
    best = fits[errors.index(min(errors))]
    simulation.set_readout(best.w_out)
    return Practised(best, tuple(errors))


def _try_lesson(course: Course, lesson: Lesson, on_steps: OnSteps) -> None:
    with suppress(DivergenceError):  # there is nothing to learn from where it went
        course.attend(lesson, on_steps=on_steps)


def _trial(simulation: Simulation, target: Target, practice: Practice, on_steps: OnSteps) -> float:
    """Orbit error at the end of a free run from total rest; the simulation stays as it was."""
    before, step = simulation.snapshot(), simulation.timestep
    total, last = round(practice.trial / step), round(practice.trial_window / step)
    simulation.reset()
    try:
        simulation.rollout(total - last, record=())
        outputs = simulation.rollout(last, record=("outputs",)).get("outputs")
        return metrics.orbit_error(outputs, target)
    except DivergenceError:
        return float("inf")
    finally:
        simulation.restore(before)
        on_steps(total)
