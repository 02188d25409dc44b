"""Figs. 10 and 11: one body, one static readout; a constant input chooses the rhythm."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.input_driven.config import (
    SYSTEM,
    Config,
    Start,
    get_start,
    sweep_profile,
    warn_outside,
)
from mcmj.experiments.input_driven.lessons import course_lesson, teach
from mcmj.experiments.input_driven.result import BodyResult, Held, Outcome, Result
from mcmj.experiments.input_driven.sweep import Sweep, branches
from mcmj.learning.free_run import free_run
from mcmj.learning.lessons import Lesson
from mcmj.learning.practice import Practised
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.input_profiles import Profile, hold
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

# what a search over many bodies leaves out, and what it is after: see mcmj.search.experiment
SEARCH_DEFAULTS = {"curve": (), "sweep": 0.0}
SEARCH_SCORE = "eps/*/orbit_error"

LEAD_IN = 20.0  # s, onto the cycle from which a body with a readout, or a sweep, sets out


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
    simulation = Simulation(start.body, **start.stepping)
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
    start = get_start(config, seed)
    simulation = Simulation(start.body, **start.stepping)
    return try_out(config, simulation, lesson, seed, on_steps)


def try_out(
    config: Config,
    simulation: Simulation,
    lesson: Lesson,
    seed: int,
    on_steps: OnSteps = lambda steps: None,
) -> Outcome:
    """Teach a body, which keeps the readout, and jump to every input; a blow-up is an outcome."""
    practised = or_lost(lambda: teach(config, simulation, lesson, seed, on_steps), None)
    if practised is None:
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
        constant = Profile([hold(value, config.free_run)])
        outputs = or_lost(partial(drive, simulation, constant, on_steps), np.zeros((0, 2)))
        held[value] = measure(config, SYSTEM.cycle(value), outputs)
    return held


def measure(config: Config, target: Target, outputs: Array) -> Held:
    """What the last part of the outputs (T, n_outputs) at a constant input is worth."""
    if len(outputs) == 0:
        return Held(target, outputs)
    last = outputs[-round(config.window / config.timestep) :]
    moves = np.ptp(last, axis=0).max() > 1e-9
    period = orbits.period(last, config.timestep, target.period) if moves else np.nan
    return Held(
        target=target,
        outputs=outputs,
        orbit_error=orbits.orbit_error(last, target),
        amplitude_error=orbits.relative_amplitude_error(last, target),
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

    def sweep() -> Array:
        drive(simulation, Profile([hold(profile.ramps[0].start, LEAD_IN)]), on_steps)
        return drive(simulation, profile, on_steps)

    outputs = or_lost(sweep, np.zeros((len(times), 2)))  # no cycles where the rhythm was lost
    wanted = SYSTEM.follow(profile)(times)
    return Sweep(*(branches(profile, signal[:, 0], step) for signal in (outputs, wanted)))


def drive(simulation: Simulation, profile: Profile, on_steps: OnSteps) -> Array:
    """Outputs (T, n_outputs) of the closed loop under a profile, from the simulation's state.

    Raises:
        DivergenceError: the body blew up.
    """
    steps = np.arange(round(profile.duration / simulation.timestep))
    inputs = profile(simulation.timestep * steps)[:, None]
    return free_run(simulation, len(steps), inputs=inputs, on_steps=on_steps)


def _check_window(config: Config, target: Target) -> None:
    needed = orbits.PERIODS_NEEDED * target.period
    if config.window < needed:
        raise InvalidArgumentError(
            "window", f"at least {needed:.4g} s, {orbits.PERIODS_NEEDED} periods of the target",
            f"{config.window:g} s",
        )  # fmt: skip
