"""FORCE learning: the loop is closed while the readout is made right.

Under a teacher a body sees only the states near what it is taught. Where its outputs act at
once, as muscles do, its signals mostly show the last command, and a regression learns to echo it
instead of leading it. So a teacher only begins: then the body's own outputs drive it, and
recursive least squares corrects the readout so often that they stay near the target. The states
that its own errors lead to are learned from too (Sussillo and Abbott, Neuron 63, 2009). What
remains is a linear, static readout, as a regression's.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from mcmj.core.callbacks.online_learning import Learner
from mcmj.learning.free_run import trial_error
from mcmj.learning.lessons import Signal, require_washout
from mcmj.learning.recursive_regression import learner_after
from mcmj.learning.regression import Regression
from mcmj.metrics import orbits
from mcmj.simulation.corrected_run import Stretch, run_corrected
from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_duration, require_number

RAMP = 1.0  # s over which a teacher begins

Start = Array | Callable[[], object] | None


@dataclass(frozen=True)
class ForceLearning:
    """How a readout is learned.

    Attributes:
        period: the readout is corrected once in this time [s].
        ridge: penalty of the squared weights, of signals of variance 1.
        warm_up: first, and after a failed trial, the teacher drives, the loop open [s] ..
        washout: .. and nothing is learned at the beginning of that [s].
        noise: on what is fed back, over the RMS size of one output of the target ..
        noise_hold: .. each held for this time [s].
        rounds: of learning in closed loop, at most; 0: by regression under the teacher alone.
        round_duration: of each [s].
        trial: after each, a free run [s] whose last half is judged; the best round counts.
        good_enough: orbit error of a trial at which learning ends.

    Raises:
        InvalidArgumentError: a number out of bounds.
    """

    period: float = 5e-3
    ridge: float = 1e-2
    warm_up: float = 6.0
    washout: float = 3.0
    noise: float = 0.1
    noise_hold: float = 0.05
    rounds: int = 4
    round_duration: float = 20.0
    trial: float = 20.0
    good_enough: float = 0.05

    def __post_init__(self) -> None:
        require_count("rounds", self.rounds, 0)
        for field in fields(self):
            if field.name != "rounds":
                low_open = field.name not in ("noise", "washout")
                require_number(field.name, getattr(self, field.name), 0.0, open_low=low_open)
        for name in ("warm_up", "round_duration", "trial"):
            require_duration(name, getattr(self, name))
        require_washout(self.washout, self.warm_up)

    @property
    def total(self) -> float:
        """Of all runs together, if no trial fails and none is good enough [s]."""
        return self.warm_up + self.rounds * (self.round_duration + self.trial)


@dataclass(frozen=True)
class Learned:
    """The best readout, and how learning went.

    Attributes:
        w_out: (n_signals + 1, n_outputs), the bias last.
        errors: orbit error of the trial after each round; infinite if it failed.
        state: snapshot of the simulation at the end of the round that counts.
    """

    w_out: Array
    errors: tuple[float, ...]
    state: Array


def force_learn(
    simulation: Reservoir,
    target: Target,
    learning: ForceLearning,
    *,
    seed: int,
    stand: Start = None,
    inputs: Signal | None = None,
    judge: Callable[[], float] | None = None,
    on_steps: OnSteps = lambda steps: None,
) -> Learned:
    """Teach a target; the simulation is left at it, in closed loop, with the best readout.

    Args:
        simulation: a body in MuJoCo, or any reservoir.
        seed: of the noise.
        stand: where the teacher begins: a snapshot, or a function that brings the simulation
            there; default: its reset.
        inputs: what enters meanwhile, of times (T,) [s] on the simulation's clock: (T, n_inputs).
        judge: error of a free run of the simulation, which may leave it anywhere; infinite if it
            failed, by a fall say: then the teacher leads again, as after a blow-up. Default: the
            orbit error of mcmj.learning.free_run without inputs.
        on_steps: called with the number of steps done, for progress bars.

    Raises:
        DivergenceError: the simulation blew up in its first round.
        InvalidArgumentError: the engine is the twin.
    """
    require_outputs(simulation, target, "simulation")
    teacher = _Teacher(simulation, target, learning, inputs, seed, on_steps)
    judge = judge or partial(trial_error, simulation, target, learning.trial, on_steps=on_steps)
    learner = teacher.begin(stand)
    best, errors = (simulation.readout.rows, simulation.snapshot()), list[float]()
    for _ in range(learning.rounds):
        try:
            if errors and np.isinf(errors[-1]):
                teacher.lead_again(stand, learner)
            teacher.correct(learner)
        except DivergenceError:
            if not errors:
                raise
            break
        now = simulation.readout.rows, simulation.snapshot()
        errors.append(judge())
        simulation.restore(now[1])
        if errors[-1] <= min(errors):
            best = now
        if errors[-1] <= learning.good_enough:
            break
    simulation.set_readout(best[0])
    simulation.restore(best[1])
    return Learned(best[0], tuple(errors), best[1])


class _Teacher:
    """What drives a simulation while it learns, on the simulation's own clock."""

    def __init__(
        self,
        simulation: Reservoir,
        target: Target,
        learning: ForceLearning,
        inputs: Signal | None,
        seed: int,
        on_steps: OnSteps,
    ) -> None:
        self._simulation, self._target, self._learning = simulation, target, learning
        self._inputs = inputs
        self._rng, self._on_steps = stream(seed, "teacher_noise"), on_steps
        step = simulation.in_mujoco.timestep
        radius = orbits.rms_radius(target.orbit(orbits.ORBIT_POINTS))
        self._every = max(1, round(learning.period / step))
        self._hold = max(1, round(learning.noise_hold / step))
        self._noise = learning.noise * radius / np.sqrt(target.n_outputs)

    def begin(self, stand: Start) -> Learner:
        """The teacher drives and a regression learns, with which the simulation then goes on."""
        start, regression = self._stand(stand), Regression(bias=True)
        for stretch in self._stretches(self._learning.warm_up - self._learning.washout, start):
            run = self._simulation.rollout(
                None, stretch.inputs, stretch.offset, 0.0, record=("signals",)
            )
            regression.add(run.get("signals")[:: self._every], stretch.targets)
            self._on_steps(len(run))
        learner = learner_after(regression, self._learning.ridge)
        run_corrected(self._simulation, learner, (), every=self._every)  # the readout, for now
        return learner

    def lead_again(self, stand: Start, learner: Learner) -> None:
        """The same, with what was learned before."""
        start = self._stand(stand)
        stretches = self._stretches(self._learning.warm_up - self._learning.washout, start)
        self._run(learner, stretches, gate=0.0)

    def correct(self, learner: Learner) -> None:
        """The simulation drives itself, and its readout is corrected."""
        self._run(learner, self._stretches(self._learning.round_duration), gate=1.0)

    def _run(self, learner: Learner, stretches: Iterator[Stretch], gate: float) -> None:
        run_corrected(
            self._simulation, learner, stretches,
            every=self._every, gate=gate, on_steps=self._on_steps,
        )  # fmt: skip

    def _stand(self, stand: Start) -> float:
        """Where a run begins, and the washout from there; the time [s] at which it began."""
        if callable(stand):
            stand()
        elif stand is None:
            self._simulation.reset()
        else:
            self._simulation.restore(stand)
        start = self._simulation.time
        for stretch in self._stretches(self._learning.washout, start):
            self._simulation.rollout(None, stretch.inputs, stretch.offset, 0.0, record=())
            self._on_steps(len(stretch.offset))
        return start

    def _stretches(self, duration: float, lead_from: float | None = None) -> Iterator[Stretch]:
        """What drives the next steps: noise, and from a time [s] on the teacher."""
        step = self._simulation.timestep
        first = round(self._simulation.time / step)
        total, longest = round(duration / step), max(1, CHUNK // self._every) * self._every
        for start in range(0, total, longest):
            count = min(longest, total - start)
            times = step * np.arange(first + start, first + start + count, dtype=np.float64)
            shape = (-(-count // self._hold), self._target.n_outputs)
            noise = self._noise * self._rng.standard_normal(shape)
            offset = np.repeat(noise, self._hold, axis=0)[:count]
            if lead_from is not None:
                ramp = np.minimum(1.0, (times - lead_from) / RAMP)
                offset += ramp[:, None] * self._target.sample(times)
            inputs = None if self._inputs is None else self._inputs(times)
            yield Stretch(self._target.sample(times[:: self._every]), offset, inputs)
