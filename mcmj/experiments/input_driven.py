"""Figs. 10 and 11: one body, one static readout; a constant input chooses the rhythm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mcmj import metrics
from mcmj.errors import DivergenceError, InvalidArgumentError
from mcmj.experiments.input_driven_config import (
    SYSTEM,
    Config,
    Start,
    get_start,
    sweep_profile,
    warn_outside,
)
from mcmj.experiments.input_sweep import Sweep, branches
from mcmj.profiles import Profile, hold
from mcmj.progress import OnSteps
from mcmj.rates import success_rate
from mcmj.readout import Fit
from mcmj.simulation import CHUNK, Simulation
from mcmj.targets import Target
from mcmj.teaching import Lesson, Signal, teach_lessons
from mcmj.validation import Array

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
    """One body: `fit` is None if its readout came with the file; `held` is by input."""

    start: Start
    w_out: Array
    fit: Fit | None
    held: dict[float, Held]
    sweep: Sweep | None


@dataclass(frozen=True)
class Result:
    """All bodies (None: blew up under the teacher); the first is drawn."""

    config: Config
    first: BodyResult
    orbit_errors: dict[float, Array]

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and rates over all seeds."""
        first = self.first
        table: dict[str, object] = {
            "eps": {f"{u:g}": run.metrics for u, run in first.held.items()},
            "sweep": self.sweep,
            "taught_inputs": first.start.taught,
            "train_nrmse": first.fit.train_nrmse if first.fit else None,
            "condition_number": first.fit.condition_number if first.fit else None,
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
        good = {u: errors < self.config.tolerance for u, errors in self.orbit_errors.items()}
        table = {
            f"{u:g}": {
                **success_rate(good[u]),
                "median_orbit_error": float(np.median(errors)),
                "orbit_errors": errors,
            }
            for u, errors in self.orbit_errors.items()
        }
        table["all_inputs"] = success_rate(np.logical_and.reduce(list(good.values())))
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
    lesson = _lesson(config) if start.w_out is None else None
    first = _of_body(config, start, config.seed, lesson, config.all_inputs, on_steps)
    others = [
        _of_other(config, seed, lesson, on_steps)
        for seed in range(config.seed + 1, config.seed + config.seeds)
    ]
    errors = {
        u: np.array([np.inf if b is None else b.held[u].orbit_error for b in [first, *others]])
        for u in config.inputs
    }
    return Result(config, first, errors)


def _lesson(config: Config) -> Lesson:
    """The course, with the target's way along it; the same for every body."""
    course = config.course
    weight: float | Signal = 1.0
    if config.size_weight != 0:
        weight = config.row_weight(SYSTEM.sizes(course.low, course.high))
    return Lesson(
        SYSTEM.follow(course),
        course.duration,
        config.run_in,
        inputs=lambda times: course(times)[:, None],
        weight=weight,
    )


def _of_body(
    config: Config,
    start: Start,
    seed: int,
    lesson: Lesson | None,
    inputs: Sequence[float],
    on_steps: OnSteps,
) -> BodyResult:
    simulation = Simulation(start.body, timestep=config.timestep, engine=config.engine)
    fit = _ready(config, simulation, start, seed, lesson, on_steps)
    state = simulation.snapshot()
    held = {}
    for value in inputs:
        simulation.restore(state)
        held[value] = _hold(config, simulation, value, on_steps)
    sweep = None
    if config.sweep > 0 and len(inputs) == len(config.all_inputs):
        simulation.restore(state)
        sweep = _sweep(config, simulation, start.taught, on_steps)
    w_out = simulation.w_out
    assert w_out is not None
    return BodyResult(start, w_out, fit, held, sweep)


def _of_other(
    config: Config, seed: int, lesson: Lesson | None, on_steps: OnSteps
) -> BodyResult | None:
    try:
        return _of_body(config, get_start(config, seed), seed, lesson, config.inputs, on_steps)
    except DivergenceError:
        return None


def _ready(
    config: Config,
    simulation: Simulation,
    start: Start,
    seed: int,
    lesson: Lesson | None,
    on_steps: OnSteps,
) -> Fit | None:
    """Teach, or bring a body that has its readout onto the cycle where teaching ended."""
    if lesson is not None:
        return teach_lessons(simulation, [lesson], config.teaching, seed, on_steps=on_steps)
    steps = round(LEAD_IN / config.timestep)
    last = config.course.last
    signal = SYSTEM.cycle(last).sample(config.timestep * np.arange(steps))
    simulation.rollout(inputs=np.full((steps, 1), last), offset=signal, gate=0.0, record=())
    simulation.set_readout(start.w_out)
    return None


def _hold(config: Config, simulation: Simulation, value: float, on_steps: OnSteps) -> Held:
    """The closed loop from the simulation's state, at a constant input."""
    target = SYSTEM.cycle(value)
    check_window(config, target)
    try:
        outputs = drive(simulation, Profile([hold(value, config.free_run)]), on_steps)
    except DivergenceError:
        return Held(target, np.zeros((0, 2)))
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
    """From the simulation's state: lead-in at the largest input, then down and up again."""
    profile = sweep_profile(config, taught)
    drive(simulation, Profile([hold(profile.ramps[0].start, LEAD_IN)]), on_steps)
    step = config.timestep
    outputs = drive(simulation, profile, on_steps)
    wanted = SYSTEM.follow(profile)(step * np.arange(len(outputs), dtype=np.float64))
    return Sweep(*(branches(profile, signal[:, 0], step) for signal in (outputs, wanted)))


def drive(simulation: Simulation, profile: Profile, on_steps: OnSteps) -> Array:
    """Outputs (T, n_outputs) of the closed loop under a profile, from the simulation's state.

    Raises:
        DivergenceError: the body blew up.
    """
    total = round(profile.duration / simulation.timestep)
    parts = []
    for start in range(0, total, CHUNK):
        steps = np.arange(start, min(start + CHUNK, total))
        inputs = profile(simulation.timestep * steps)[:, None]
        parts.append(simulation.rollout(inputs=inputs, record=("outputs",)).get("outputs"))
        on_steps(len(steps))
    return np.concatenate(parts)


def check_window(config: Config, target: Target) -> None:
    """Raise unless the window is long enough to measure a target's period."""
    needed = metrics.PERIODS_NEEDED * target.period
    if config.window < needed:
        raise InvalidArgumentError(
            "window", f"at least {needed:.4g} s, {metrics.PERIODS_NEEDED} periods of the target",
            f"{config.window:g} s",
        )  # fmt: skip
