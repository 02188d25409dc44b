"""FORCE learning: the loop is closed while the readout is made right.

Under a teacher a body sees only the states near what it is taught. Where its outputs act at
once, as muscles do, its springs mostly show the last command, and a regression learns to echo
it instead of leading it. So a teacher only begins: then the body's own outputs drive it, and
recursive least squares corrects the readout so often that they stay near the target.
The states that its own errors lead to are learned from too (Sussillo and Abbott, Neuron 63,
2009). What remains is a linear, static readout, as a regression's.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields

import numpy as np

from mcmj.learning.recursive_regression import RecursiveLeastSquares
from mcmj.learning.regression import Fit, Regression
from mcmj.metrics import orbits
from mcmj.robots import walk_metrics
from mcmj.robots.trunk import N_MUSCLES
from mcmj.robots.trunk_walker import TrunkWalker
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_duration, require_number

RAMP = 1.0  # s over which a teacher begins


@dataclass(frozen=True)
class ForceLearning:
    """How a robot learns.

    Attributes:
        period: a readout is corrected once in this time [s].
        ridge: penalty of the squared weights, in squared lengths [m^2].
        warm_up: first, and after a fall, the teacher drives the muscles, the loop open [s] ..
        washout: .. and nothing is learned at the beginning of that [s].
        noise: on the muscles' commands, over their RMS change of length ..
        noise_hold: .. each held for this time [s].
        rounds: of learning in closed loop, at most.
        round_duration: of each [s].
        trial: after each, a free run [s] whose last half is judged; the best round counts.
        good_enough: orbit error of a trial at which learning ends.

    Raises:
        InvalidArgumentError: a number out of bounds.
    """

    period: float = 5e-3
    ridge: float = 5e-9
    warm_up: float = 6.0
    washout: float = 3.0
    noise: float = 0.1
    noise_hold: float = 0.05
    rounds: int = 4
    round_duration: float = 20.0
    trial: float = 20.0
    good_enough: float = 0.05

    def __post_init__(self) -> None:
        require_count("rounds", self.rounds, 1)
        for field in fields(self):
            if field.name != "rounds":
                low_open = field.name != "noise"
                require_number(field.name, getattr(self, field.name), 0.0, open_low=low_open)
        for name in ("warm_up", "round_duration", "trial"):
            require_duration(name, getattr(self, name))
        for name in ("round_duration", "trial"):
            require_number(name, getattr(self, name), 1.0)


@dataclass(frozen=True)
class Learned:
    """The best readout, and how learning went.

    Attributes:
        w_out: (n_sensed + 1, N_MUSCLES).
        errors: orbit error of the trial after each round; infinite after a fall.
        state: of the robot at the end of the round that counts.
    """

    w_out: Array
    errors: tuple[float, ...]
    state: Array


def force_learn(
    walker: TrunkWalker,
    target: Target,
    learning: ForceLearning,
    *,
    seed: int,
    on_steps: OnSteps = lambda steps: None,
) -> Learned:
    """Teach a robot a gait; it is left in it, in closed loop, with the best readout.

    A robot that falls in a trial stands up and is led by the teacher again.

    Args:
        target: of the muscles, see mcmj.robots.trunk.muscle_target.
        seed: of the noise.
        on_steps: called with the number of steps done, for progress bars.

    Raises:
        DivergenceError: the robot blew up in its first round.
    """
    lessons = _Lessons(walker, target, learning, seed, on_steps)
    squares = RecursiveLeastSquares(walker.trunk.n_sensed + 1, N_MUSCLES, ridge=learning.ridge)
    best: tuple[Array, Array] | None = None
    errors: list[float] = []
    for _ in range(learning.rounds):
        try:
            if not errors or np.isinf(errors[-1]):
                lessons.lead(learning.warm_up, squares.update)
            lessons.correct(learning.round_duration, squares)
        except DivergenceError:
            if best is None:
                raise
            break
        w_out, state = walker.w_out, walker.state
        errors.append(trial_error(walker, target, learning.trial))
        on_steps(round(learning.trial / walker.timestep))
        walker.restore(state)
        if errors[-1] <= min(errors):
            best = w_out, state
        if errors[-1] <= learning.good_enough:
            break
    assert best is not None
    walker.close(True)
    walker.set_readout(best[0])
    walker.restore(best[1])
    return Learned(best[0], tuple(errors), best[1])


def learn_by_regression(
    walker: TrunkWalker, target: Target, learning: ForceLearning, *, duration: float, seed: int
) -> Fit:
    """Teach a robot by plain ridge regression; it is left in closed loop with the readout.

    Noise and ridge are those of learning (Hauser et al. 2012, section 4, has such noise on what
    is fed back).

    Args:
        duration: of the teacher's driving that is learned from [s].
        seed: of the noise.

    Raises:
        DivergenceError: the robot blew up.
    """
    lessons = _Lessons(walker, target, learning, seed, lambda steps: None)
    samples: list[tuple[Array, Array]] = []
    lessons.lead(learning.washout + duration, lambda *sample: samples.append(sample))
    features, wanted = (np.array(each) for each in zip(*samples, strict=True))
    regression = Regression(bias=True)
    regression.add(features[:, :-1], wanted)
    fit = regression.solve(ridge=learning.ridge)
    walker.set_readout(fit.w_out)
    walker.close(True)
    return fit


class _Lessons:
    """One robot and its teacher, whose clock goes on."""

    def __init__(
        self,
        walker: TrunkWalker,
        target: Target,
        learning: ForceLearning,
        seed: int,
        on_steps: OnSteps,
    ) -> None:
        self._walker, self._target, self._learning = walker, target, learning
        self._rng, self._on_steps = stream(seed, "teacher_noise"), on_steps
        self._every = max(1, round(learning.period / walker.timestep))
        self._period = self._every * walker.timestep
        self._done = 0

    def lead(self, duration: float, hear: Callable[[Array, Array], object]) -> None:
        """The robot stands up, then the teacher drives its muscles, the loop open.

        Args:
            hear: gets features and what the muscles are told, after the washout.
        """
        walker, begin = self._walker, self._done * self._period
        walker.stand()
        for time, noise in self._moments(duration):
            wanted = self._target.sample([time])[0]
            if time - begin >= self._learning.washout:
                hear(walker.features(), wanted)
            walker.advance(self._every, min(1.0, (time - begin) / RAMP) * wanted + noise)

    def correct(self, duration: float, squares: RecursiveLeastSquares) -> None:
        """The robot drives itself, and its readout is corrected."""
        walker = self._walker
        walker.close(True)
        for time, noise in self._moments(duration):
            squares.update(walker.features(), self._target.sample([time])[0])
            walker.set_readout(squares.weights)
            walker.advance(self._every, noise)

    def _moments(self, duration: float) -> Iterator[tuple[float, Array]]:
        """Times [s] and noise (N_MUSCLES,) [m] of the next corrections."""
        count = round(duration / self._period)
        hold = max(1, round(self._learning.noise_hold / self._period))
        radius = orbits.rms_radius(self._target.orbit(orbits.ORBIT_POINTS))
        size = self._learning.noise * radius / np.sqrt(N_MUSCLES)
        noise = size * self._rng.standard_normal((-(-count // hold), N_MUSCLES))
        for k in range(count):
            yield self._done * self._period, noise[k // hold]
            self._done += 1
        self._on_steps(count * self._every)


def trial_error(walker: TrunkWalker, target: Target, duration: float) -> float:
    """Orbit error of the commands in the last half of a free run; infinite after a fall."""
    try:
        walk = walker.walk(duration)
    except DivergenceError:
        return float("inf")
    if np.isfinite(walk_metrics.fall_times(walk, walker.trunk.settings.leg)[0]):
        return float("inf")
    return orbits.orbit_error(walk.after(duration / 2).outputs[0], target)
