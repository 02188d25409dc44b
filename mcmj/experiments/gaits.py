"""Figs. 8 and 9: one body, four gaits; a switch of the readout is a switch of the gait."""

from collections.abc import Mapping

import numpy as np

from mcmj.body import Body
from mcmj.errors import DivergenceError, UnknownNameError
from mcmj.experiments.gaits_config import Config, check, get_body
from mcmj.experiments.gaits_result import BodyResult, Result, Run, Taught, measure, outcome
from mcmj.gaits import LEGS, gait_target
from mcmj.mjcf import checked_readout
from mcmj.progress import OnSteps
from mcmj.schedule import Phase, Schedule, run_schedule
from mcmj.simulation import Simulation
from mcmj.teaching import synchronise, teach
from mcmj.validation import Array

LOST = np.zeros((0, len(LEGS)))  # outputs of a run that blew up


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body every gait, run each free and from rest, make every switch.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do it.
    """
    first, outcomes = None, []
    for seed in range(config.first_seed, config.first_seed + config.seeds):
        body, readouts, source = get_body(config, seed)
        result = run_body(config, body, readouts, seed, source=source, on_steps=on_steps)
        outcomes.append(outcome(result, seed, config.tolerance))
        first = first or result  # the outputs of the others are not kept
    assert first is not None
    return Result(config, first, outcomes)


def run_body(
    config: Config,
    body: Body,
    readouts: Mapping[str, object],
    seed: int,
    *,
    source: Mapping[str, object] | None = None,
    on_steps: OnSteps = lambda steps: None,
) -> BodyResult:
    """All gaits and switches of one body; gaits without a readout are taught.

    Raises:
        InvalidArgumentError, UnknownNameError: a body without four feedback channels, a readout
            of a wrong size or for another gait.
    """
    check(config, body)
    for name in readouts:
        if name not in config.gaits:
            raise UnknownNameError("gait", name, config.gaits)
    given = {name: checked_readout(body, w, f"readout {name}") for name, w in readouts.items()}
    simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
    gaits, running = {}, {}
    for name in config.gaits:
        gaits[name] = _run_gait(config, simulation, name, given.get(name), seed, on_steps)
        running[name] = simulation.snapshot()
    switches = {}
    for first, second in config.pairs:
        simulation.reset()
        simulation.restore(running[first])
        switches[first, second] = _switch(config, simulation, gaits[first], gaits[second], on_steps)
    return BodyResult(body, dict(source or {}), gaits, switches)


def _run_gait(
    config: Config,
    simulation: Simulation,
    name: str,
    w_out: Array | None,
    seed: int,
    on_steps: OnSteps,
) -> Taught:
    """Teach a gait, run from rest, then free; the simulation is left in the free run."""
    wanted, fit = gait_target(name), None
    simulation.reset()
    try:
        if w_out is None:
            fit = teach(simulation, wanted, config.teaching, seed, on_steps=on_steps)
            w_out = fit.w_out
        else:
            synchronise(simulation, wanted, config.teaching.washout)
            simulation.set_readout(w_out)
    except DivergenceError:
        lost = measure(config, LOST, wanted)
        return Taught(wanted, w_out, fit, lost, lost)
    taught = simulation.snapshot()
    simulation.reset()
    from_rest = measure(config, _rollout(config, simulation, config.from_rest, on_steps), wanted)
    simulation.restore(taught)
    free = measure(config, _rollout(config, simulation, config.free_run, on_steps), wanted)
    return Taught(wanted, w_out, fit, free, from_rest)


def _rollout(config: Config, simulation: Simulation, seconds: float, on_steps: OnSteps) -> Array:
    parts = []
    try:
        for part in simulation.stream(round(seconds / config.timestep), record=("outputs",)):
            parts.append(part.get("outputs"))
            on_steps(len(part))
    except DivergenceError:
        return LOST
    return np.concatenate(parts)


def _switch(
    config: Config, simulation: Simulation, first: Taught, second: Taught, on_steps: OnSteps
) -> Run:
    """Go on in one gait, then replace its readout by another's, at once."""
    phases = [Phase(config.before, w_out=first.w_out), Phase(config.after, w_out=second.w_out)]
    if not all(len(gait.free.outputs) for gait in (first, second)):
        return measure(config, LOST, second.target)
    try:
        run = run_schedule(simulation, Schedule(phases), 0, on_steps=on_steps)
    except DivergenceError:
        return measure(config, LOST, second.target)
    return measure(config, run.feedback, second.target, switched=run.boundaries[1])
