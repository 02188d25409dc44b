"""How a body is scored: taught by teacher forcing, then run from off the cycle."""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.input_driven import config as input_driven
from mcmj.experiments.input_driven.lessons import course_lesson
from mcmj.experiments.input_driven.run import try_out
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import teach
from mcmj.metrics.orbits import orbit_error
from mcmj.reference.integration import integrate_smooth
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

INPUT_DRIVEN = "input_driven"
NODES = {"van_der_pol": 10, "quadratic": 10, "lissajous": 15, INPUT_DRIVEN: 40}
USUAL_NODES = 25
QUICK = Teaching(duration=60.0, washout=15.0, every=5)  # at most, where candidates are screened
QUICK_RUN, EXACT_RUN = 60.0, 90.0  # s
WINDOW = 20.0  # s: the errors are those of this last part of a free run
EXACT_RTOL = 1e-7  # of DOP853: far below the orbit errors, and much cheaper than 1e-12
SPARSE = 5  # of the outputs, every n-th: the orbit is a polygon through them
WORST = 1.0  # log10 of an error that counts for all that are worse, blow-ups too


@dataclass(frozen=True)
class Tried:
    """A body taught and run.

    Attributes:
        errors: orbit errors, one a rhythm; infinite if the body blew up.
        w_out: its readout; None if it blew up under the teacher.
    """

    errors: tuple[float, ...]
    w_out: Array | None = None

    @property
    def worst(self) -> float:
        """The largest of the errors."""
        return max(self.errors)

    @property
    def score(self) -> float:
        """Mean of log10 of the errors, each at most WORST: small is good."""
        return float(np.minimum(np.log10(np.maximum(self.errors, 1e-12)), WORST).mean())


class Judge(Protocol):
    """A task, as a body is tried at it; the noise is the seed's."""

    def settings(self, nodes: int) -> BodySettings:
        """What random bodies for it are drawn from."""

    def quick(self, body: Body, seed: int) -> Tried:
        """A short course and a short run, for a first look."""

    def full(self, body: Body, seed: int, engine: str = "twin") -> Tried:
        """The whole course and the whole run."""

    def exact(self, body: Body, w_out: Array) -> float | None:
        """Orbit error of a readout under DOP853 with continuous feedback; None: not known."""


@dataclass(frozen=True)
class LimitCycle:
    """A limit cycle: taught on it, then started from total rest.

    Attributes:
        target: to learn.
        teaching: the whole course.
        free_run: from rest, its last WINDOW is judged [s].
    """

    target: Target
    teaching: Teaching
    free_run: float

    def settings(self, nodes: int) -> BodySettings:
        """With a feedback channel for each output of the target."""
        return BodySettings(nodes=nodes, n_outputs=self.target.n_outputs)

    def quick(self, body: Body, seed: int) -> Tried:
        """At most QUICK of the course and QUICK_RUN of the run."""
        return self._try(body, seed, self._short, min(self.free_run, QUICK_RUN), "twin")

    @property
    def _short(self) -> Teaching:
        return replace(
            self.teaching,
            duration=min(self.teaching.duration, QUICK.duration),
            washout=min(self.teaching.washout, QUICK.washout),
            every=max(self.teaching.every, QUICK.every),
        )

    def full(self, body: Body, seed: int, engine: str = "twin") -> Tried:
        """The whole course, then the free run from total rest."""
        return self._try(body, seed, self.teaching, self.free_run, engine)

    def exact(self, body: Body, w_out: Array) -> float | None:
        """From total rest, EXACT_RUN at most."""
        steps = round(min(self.free_run, EXACT_RUN) / 1e-3)
        found = or_lost(
            lambda: integrate_smooth(body, steps=steps, w_out=w_out, rtol=EXACT_RTOL), None
        )
        return np.inf if found is None else self._error(found.get("outputs"))

    def noisy(self, body: Body, seed: int, deviation: float) -> Tried:
        """After a short course, two errors: from total rest, and that with noise on all lengths.

        Args:
            deviation: of the white noise [m].
        """
        simulation = Simulation(body, engine="twin")
        steps = round(self.free_run / simulation.timestep)

        def errors() -> tuple[float, float]:
            teach(simulation, self.target, self._short, seed)
            readout = simulation.w_out
            assert readout is not None
            noise = stream(seed, "schedule_noise").standard_normal((steps, len(readout)))
            fed_back = deviation * noise @ readout
            quiet = self._from_rest(simulation, steps, None)
            return quiet, or_lost(lambda: self._from_rest(simulation, steps, fed_back), np.inf)

        return Tried(or_lost(errors, (np.inf, np.inf)), simulation.w_out)

    def _try(self, body: Body, seed: int, teaching: Teaching, run: float, engine: str) -> Tried:
        simulation = Simulation(body, engine=engine)

        def error() -> float:
            teach(simulation, self.target, teaching, seed)
            return self._from_rest(simulation, round(run / simulation.timestep), None)

        return Tried((or_lost(error, np.inf),), simulation.w_out)

    def _from_rest(self, simulation: Simulation, steps: int, offset: Array | None) -> float:
        """Orbit error at the end of a free run, to whose feedback an offset is added."""
        simulation.reset()
        first = steps - min(steps, round(WINDOW / simulation.timestep))
        before, last = (None, None) if offset is None else (offset[:first], offset[first:])
        if first:
            simulation.rollout(first, offset=before, record=())
        run = simulation.rollout(steps - first, offset=last, record=("outputs",))
        return self._error(run.get("outputs"))

    def _error(self, outputs: Array) -> float:
        last = outputs[-round(WINDOW / 1e-3) :: SPARSE]
        return orbit_error(last, self.target)


@dataclass(frozen=True)
class InputDriven:
    """Three rhythms chosen by an input, each jumped to: the experiment input_driven as it is.

    Attributes:
        config: of that experiment.
    """

    config: input_driven.Config = field(
        default_factory=lambda: input_driven.Config(engine="twin", curve=(), sweep=0.0)
    )

    def settings(self, nodes: int) -> BodySettings:
        """Those of the experiment."""
        return replace(self.config.settings, nodes=nodes)

    def quick(self, body: Body, seed: int) -> Tried:
        """Without practice."""
        practice = replace(self.config.practice, rounds=0)
        return self._try(body, seed, replace(self.config, practice=practice))

    def full(self, body: Body, seed: int, engine: str = "twin") -> Tried:
        """With practice of the jumps."""
        return self._try(body, seed, replace(self.config, engine=engine))

    def exact(self, body: Body, w_out: Array) -> float | None:
        """Not known."""
        return None

    def _try(self, body: Body, seed: int, config: input_driven.Config) -> Tried:
        simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
        outcome = try_out(config, simulation, course_lesson(config), seed)
        return Tried(tuple(outcome.orbit_errors.values()), simulation.w_out)


def judge_of(task: str, teaching: Teaching, free_run: float) -> Judge:
    """The judge of a task: a target by its name, or input_driven.

    Raises:
        UnknownNameError: neither.
    """
    if task == INPUT_DRIVEN:
        return InputDriven()
    return LimitCycle(named_target(task, INPUT_DRIVEN), teaching, free_run)
