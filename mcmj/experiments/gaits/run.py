"""Figs. 8 and 9: one body, four gaits; a switch of the readout is a switch of the gait."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mcmj.core.readout import checked_readout
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.gaits.config import Config, check, get_body
from mcmj.experiments.gaits.result import BodyResult, GaitRun, Result, Taught, measure, outcome
from mcmj.learning.free_run import free_run
from mcmj.learning.practice import practise
from mcmj.learning.regression import Fit
from mcmj.learning.teaching import Course, lessons_of, synchronise
from mcmj.metrics import orbits
from mcmj.mjcf.bundled import StoredBody
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.targets.gaits import LEGS, gait_target
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

SEARCH_SCORE = "worst_error/*"  # see mcmj.search.experiment
LOST = np.zeros((0, len(LEGS)))  # outputs of a run that blew up


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body every gait, run each free and from rest, make every switch.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do it.
    """
    first, outcomes = None, []
    for seed in config.source.all_seeds:
        result = run_body(config, get_body(config, seed), seed, on_steps=on_steps)
        outcomes.append(outcome(result, seed, config.tolerance))
        first = first or result  # the outputs of the others are not kept
    assert first is not None
    return Result(config, first, outcomes)


def run_body(
    config: Config,
    stored: StoredBody,
    seed: int,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> BodyResult:
    """All gaits and switches of one body; gaits without a readout are taught.

    Raises:
        InvalidArgumentError, UnknownNameError: a body without four feedback channels, a readout
            of a wrong size or for another gait.
    """
    body, readouts = stored.body, stored.readouts
    check(config, body)
    for name in readouts:
        if name not in config.gaits:
            raise UnknownNameError("gait", name, config.gaits)
    given = {name: checked_readout(body, w, f"readout {name}") for name, w in readouts.items()}
    stepping = stored.take(timestep=config.timestep, engine=config.engine)
    simulation = Simulation(body, **stepping)
    learnt = {
        name: _learn(config, simulation, name, given.get(name), seed, on_steps)
        for name in config.gaits
    }
    _practise_all(config, learnt, on_steps)
    gaits, running = {}, {}
    for name, one in learnt.items():
        gaits[name] = _run_gait(config, simulation, one, on_steps)
        running[name] = simulation.snapshot()
    switches = {}
    for first, second in config.pairs:
        simulation.reset()
        simulation.restore(running[first])
        switches[first, second] = _switch(config, simulation, gaits[first], gaits[second], on_steps)
    return BodyResult(body, stored.provenance, stepping, gaits, switches)


@dataclass
class _Learnt:
    """A gait after its lessons: course and fit if it was taught, and states on its cycle.

    `w_out` is None, and there are no states, if the body blew up under the teacher.
    """

    target: Target
    w_out: Array | None = None
    course: Course | None = None
    fit: Fit | None = None
    states: tuple[Array, ...] = ()


def _learn(
    config: Config,
    simulation: Simulation,
    name: str,
    w_out: Array | None,
    seed: int,
    on_steps: OnSteps,
) -> _Learnt:
    """Teach a gait, or bring the body onto it; then gather states all around its cycle."""
    learnt = _Learnt(gait_target(name), w_out)
    simulation.reset()
    try:
        if w_out is None:
            learnt.course = Course(simulation, config.teaching, seed)
            learnt.course.attend_all(lessons_of(learnt.target, config.teaching), on_steps=on_steps)
            learnt.fit = learnt.course.fit()
            learnt.w_out = learnt.fit.w_out
        else:
            synchronise(simulation, learnt.target, config.teaching.washout)
    except DivergenceError:
        return _Learnt(learnt.target)
    states = [simulation.snapshot()]
    for _ in range(config.phases - 1):
        synchronise(simulation, learnt.target, learnt.target.period / config.phases)
        states.append(simulation.snapshot())
    learnt.states = tuple(states)
    return learnt


def _practise_all(config: Config, learnt: Mapping[str, _Learnt], on_steps: OnSteps) -> None:
    """Every gait that was taught practises to come up from rest and from the other gaits."""
    for name, one in learnt.items():
        if one.course is None:
            continue
        others = [state for other in learnt if other != name for state in learnt[other].states]

        def judge(outputs: Array, wanted: Target = one.target) -> float:
            period = orbits.relative_period_error(outputs, config.timestep, wanted)
            return max(orbits.orbit_error(outputs, wanted), period)

        practised = practise(
            one.course, one.target, config.practice, starts=others, judge=judge, on_steps=on_steps
        )
        one.fit, one.w_out = practised.fit, practised.fit.w_out


def _run_gait(config: Config, simulation: Simulation, learnt: _Learnt, on_steps: OnSteps) -> Taught:
    """Run from rest, then free from the cycle; the simulation is left in the free run."""
    wanted, w_out = learnt.target, learnt.w_out
    if w_out is None:
        lost = measure(config, LOST, wanted)
        return Taught(wanted, None, None, lost, lost)

    def run_free(seconds: float) -> GaitRun:
        steps = round(seconds / config.timestep)
        found = or_lost(lambda: free_run(simulation, steps, on_steps=on_steps), LOST)
        return measure(config, found, wanted)

    simulation.set_readout(w_out)
    simulation.reset()
    from_rest = run_free(config.from_rest)
    simulation.restore(learnt.states[0])
    return Taught(wanted, w_out, learnt.fit, run_free(config.free_run), from_rest)


def _switch(
    config: Config, simulation: Simulation, first: Taught, second: Taught, on_steps: OnSteps
) -> GaitRun:
    """Go on in one gait, then replace its readout by another's, at once."""
    phases = [Phase(config.before, w_out=first.w_out), Phase(config.after, w_out=second.w_out)]
    run = None
    if len(first.free.outputs) and len(second.free.outputs):
        schedule = Schedule(phases)
        run = or_lost(lambda: run_schedule(simulation, schedule, 0, on_steps=on_steps), None)
    if run is None:
        return measure(config, LOST, second.target)
    return measure(config, run.feedback, second.target, switched=run.boundaries[1])
