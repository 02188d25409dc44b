"""Figs. 10 and 11: one body, one static readout; a constant input chooses the rhythm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mcmj import metrics
from mcmj.body import Body
from mcmj.errors import DivergenceError, InvalidArgumentError
from mcmj.experiments.input_driven_config import (
    SYSTEM,
    Config,
    Start,
    get_start,
    sweep_profile,
    warn_outside,
)
from mcmj.experiments.input_lessons import course_lesson, teach
from mcmj.experiments.input_sweep import Sweep, branches
from mcmj.practice import Practised
from mcmj.profiles import Profile, hold
from mcmj.progress import OnSteps
from mcmj.rates import success_rate
from mcmj.simulation import Simulation
from mcmj.targets import Target
from mcmj.teaching import Lesson
from mcmj.validation import Array

# what a search over many bodies leaves out, and what it is after: see mcmj.search.experiment
SEARCH_DEFAULTS = {"curve": (), "sweep": 0.0}
SEARCH_SCORE = "eps/*/orbit_error"

LEAD_IN = 20.0  # s, onto the cycle from which a body with a readout, or a sweep, sets out


@dataclass(frozen=True)
class Held:
    """The closed loop at a constant input, from the state after teaching.

    Attributes:
        target: limit cycle at that input.
        outputs: (T, n_outputs) from the jump on; empty if the body blew up.
        orbit_error: of the last part, as all below; infinite if it blew up.
        amplitude_error: largest over the outputs of |A / A* - 1|, A = max - min.
        frequency_error: |f / f* - 1|, infinite without a rhythm.
        amplitude: half of the first output's range.
        frequency: [Hz]; NaN without a rhythm.
    """

    target: Target
    outputs: Array
    orbit_error: float = np.inf
    amplitude_error: float = np.inf
    frequency_error: float = np.inf
    amplitude: float = np.nan
    frequency: float = np.nan

    @property
    def metrics(self) -> dict[str, float]:
        """Errors, and amplitude and frequency beside the target's."""
        names = ("orbit_error", "amplitude_error", "frequency_error", "amplitude", "frequency")
        return {
            **{name: getattr(self, name) for name in names},
            "target_amplitude": self.target_amplitude,
            "target_frequency": 1.0 / self.target.period,
        }

    @property
    def target_amplitude(self) -> float:
        """Half of the range of the target's first output."""
        return 0.5 * float(np.ptp(self.target.orbit(metrics.ORBIT_POINTS)[:, 0]))


@dataclass(frozen=True)
class BodyResult:
    """One body: `practised` is None if its readout came with the file; `held` is by input."""

    start: Start
    w_out: Array
    practised: Practised | None
    held: dict[float, Held]
    sweep: Sweep | None


@dataclass(frozen=True)
class Outcome:
    """What counts for the rates: orbit errors by input, and how practice went.

    Attributes:
        orbit_errors: infinite if the body blew up under the teacher.
        practice_errors: of the worst jump after teaching and after every round; empty if
            nothing was taught.
    """

    orbit_errors: dict[float, float]
    practice_errors: tuple[float, ...]


@dataclass(frozen=True)
class Result:
    """The first body, which is drawn, and the outcomes of all."""

    config: Config
    first: BodyResult
    outcomes: list[Outcome]

    @property
    def body(self) -> Body:
        """The first body."""
        return self.first.start.body

    @property
    def readouts(self) -> dict[str, Array]:
        """The readout that the first body runs, and others that its file holds, by name."""
        own, others = self.config.readout_name, self.first.start.readouts
        return {own: self.first.w_out, **{name: others[name] for name in others if name != own}}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and rates over all seeds."""
        first = self.first
        fit = first.practised.fit if first.practised else None
        table: dict[str, object] = {
            "eps": {f"{u:g}": run.metrics for u, run in first.held.items()},
            "sweep": self.sweep,
            "taught_inputs": first.start.taught,
            "train_nrmse": fit.train_nrmse if fit else None,
            "condition_number": fit.condition_number if fit else None,
            "practice_errors": self.outcomes[0].practice_errors,
        }
        if self.config.seeds > 1:
            table["rates"] = self.rates
        return table

    @property
    def sweep(self) -> dict[str, object] | None:
        """Hysteresis from the smallest of the inputs jumped to on, and over the whole range."""
        sweep = self.first.sweep
        if sweep is None:
            return None
        return {
            **sweep.differences(min(self.config.inputs)),
            "whole_range": sweep.differences(),
        }

    @property
    def rates(self) -> dict[str, dict[str, object]]:
        """How many bodies run each of the inputs jumped to, and all of them."""
        tolerance = self.config.tolerance
        by_input = {
            u: np.array([one.orbit_errors[u] for one in self.outcomes]) for u in self.config.inputs
        }
        table = {
            f"{u:g}": {
                **success_rate(errors < tolerance),
                "median_orbit_error": float(np.median(errors)),
                "orbit_errors": errors,
            }
            for u, errors in by_input.items()
        }
        practice = [one.practice_errors for one in self.outcomes]
        table["all_inputs"] = {
            **success_rate(np.max(list(by_input.values()), axis=0) < tolerance),
            "without_practice": success_rate([bool(e) and e[0] < tolerance for e in practice]),
            "rounds": [max(0, len(errors) - 1) for errors in practice],
        }
        return table


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach (or load), jump to every input from the same state, and sweep.

    Only the first body is measured at the curve's inputs and swept.

    Raises:
        DivergenceError: the first body blew up under the teacher.
        BodyFileError, InvalidArgumentError, UnknownNameError: a body that cannot do the task.
    """
    start = get_start(config, config.seed)
    warn_outside(config, start.taught)
    for value in config.all_inputs:
        _check_window(config, SYSTEM.cycle(value))
    lesson = course_lesson(config) if start.w_out is None else None
    first = _of_first(config, start, lesson, on_steps)
    others = range(config.seed + 1, config.seed + config.seeds)
    outcomes = [_of_seed(config, seed, lesson, on_steps) for seed in others]
    return Result(config, first, [_outcome(config, first.held, first.practised), *outcomes])


def _of_first(config: Config, start: Start, lesson: Lesson | None, on_steps: OnSteps) -> BodyResult:
    simulation = Simulation(start.body, timestep=config.timestep, engine=config.engine)
    if lesson is None:
        practised = None
        _lead_in(config, simulation)
        simulation.set_readout(start.w_out)
    else:
        practised = teach(config, simulation, lesson, config.seed, on_steps)
    w_out, state = simulation.w_out, simulation.snapshot()
    assert w_out is not None
    held = _jump(config, simulation, config.all_inputs, on_steps)
    sweep = None
    if config.sweep > 0:
        simulation.restore(state)
        sweep = _sweep(config, simulation, start.taught, on_steps)
    return BodyResult(start, w_out, practised, held, sweep)


def _of_seed(config: Config, seed: int, lesson: Lesson | None, on_steps: OnSteps) -> Outcome:
    """A random body, taught and tried."""
    assert lesson is not None
    body = get_start(config, seed).body
    simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
    try:
        practised = teach(config, simulation, lesson, seed, on_steps)
    except DivergenceError:
        return Outcome(dict.fromkeys(config.inputs, np.inf), ())
    held = _jump(config, simulation, config.inputs, on_steps)
    return _outcome(config, held, practised)


def _outcome(config: Config, held: Mapping[float, Held], practised: Practised | None) -> Outcome:
    errors = {value: held[value].orbit_error for value in config.inputs}
    return Outcome(errors, practised.errors if practised else ())


def _lead_in(config: Config, simulation: Simulation) -> None:
    """Bring a body that has its readout onto the cycle where teaching ended, by its target."""
    times = config.timestep * np.arange(round(LEAD_IN / config.timestep))
    last = config.course.last
    simulation.rollout(
        inputs=np.full((len(times), 1), last),
        offset=SYSTEM.cycle(last).sample(times),
        gate=0.0,
        record=(),
    )


def _jump(
    config: Config, simulation: Simulation, inputs: Sequence[float], on_steps: OnSteps
) -> dict[float, Held]:
    """The closed loop at each constant input, always from the simulation's state now."""
    state = simulation.snapshot()
    held = {}
    for value in inputs:
        simulation.restore(state)
        try:
            outputs = drive(simulation, Profile([hold(value, config.free_run)]), on_steps)
        except DivergenceError:
            outputs = np.zeros((0, 2))
        held[value] = measure(config, SYSTEM.cycle(value), outputs)
    return held


def measure(config: Config, target: Target, outputs: Array) -> Held:
    """What the last part of the outputs (T, n_outputs) at a constant input is worth."""
    if len(outputs) == 0:
        return Held(target, outputs)
    last = outputs[-round(config.window / config.timestep) :]
    moves = np.ptp(last, axis=0).max() > 1e-9
    period = metrics.period(last, config.timestep, target.period) if moves else np.nan
    return Held(
        target=target,
        outputs=outputs,
        orbit_error=metrics.orbit_error(last, target),
        amplitude_error=metrics.relative_amplitude_error(last, target),
        frequency_error=np.inf if np.isnan(period) else abs(target.period / period - 1.0),
        amplitude=0.5 * float(np.ptp(last[:, 0])),
        frequency=1.0 / period,
    )


def _sweep(
    config: Config, simulation: Simulation, taught: tuple[float, float], on_steps: OnSteps
) -> Sweep:
    """From the simulation's state: some time at the largest input, then down and up again."""
    profile = sweep_profile(config, taught)
    step = config.timestep
    times = step * np.arange(round(profile.duration / step), dtype=np.float64)
    try:
        drive(simulation, Profile([hold(profile.ramps[0].start, LEAD_IN)]), on_steps)
        outputs = drive(simulation, profile, on_steps)
    except DivergenceError:
        outputs = np.zeros((len(times), 2))  # no cycles: the rhythm was lost
    wanted = SYSTEM.follow(profile)(times)
    return Sweep(*(branches(profile, signal[:, 0], step) for signal in (outputs, wanted)))


def drive(simulation: Simulation, profile: Profile, on_steps: OnSteps) -> Array:
    """Outputs (T, n_outputs) of the closed loop under a profile, from the simulation's state.

    Raises:
        DivergenceError: the body blew up.
    """
    steps = np.arange(round(profile.duration / simulation.timestep))
    inputs = profile(simulation.timestep * steps)[:, None]
    parts = []
    for part in simulation.stream(inputs=inputs, record=("outputs",)):
        parts.append(part.get("outputs"))
        on_steps(len(part))
    return np.concatenate(parts)


def _check_window(config: Config, target: Target) -> None:
    needed = metrics.PERIODS_NEEDED * target.period
    if config.window < needed:
        raise InvalidArgumentError(
            "window", f"at least {needed:.4g} s, {metrics.PERIODS_NEEDED} periods of the target",
            f"{config.window:g} s",
        )  # fmt: skip
