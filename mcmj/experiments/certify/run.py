"""The report card of a trained body: how good its rhythm is, and how hard to destroy."""

import os
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from mcmj.analysis.stability.basin import Survey, kicked, on_cycle, pushed, scaled_starts, survey
from mcmj.analysis.stability.confirm import monodromy_error, verdicts
from mcmj.analysis.stability.cycle import Cycle, find_cycle
from mcmj.analysis.stability.floquet import floquet, target_multipliers
from mcmj.analysis.stability.loop import ClosedLoop
from mcmj.analysis.stability.lyapunov import lyapunov_exponent
from mcmj.analysis.stability.phase import phase_diffusion
from mcmj.analysis.stability.tolerance import Trial, force_tolerance, noise_tolerance
from mcmj.experiments.certify.config import Config
from mcmj.experiments.certify.result import Result
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.experiments.limit_cycle.run import cycle_errors
from mcmj.learning.recipe import train
from mcmj.learning.teaching import synchronise
from mcmj.metrics import orbits
from mcmj.reference.twin.population import rest as rest_state
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target, require_outputs
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

STAGES = ("run", "floquet", "lyapunov", "phase", "starts", "kicks", "pushes", "force", "noise")


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach if need be, run in MuJoCo, and certify.

    Raises:
        DivergenceError: the free run blew up.
        McmjError: the free run is not on the target's orbit: there is nothing to certify.
    """
    goal = named_target(config.task)
    with threadpool_limits(1, "blas"):
        trained = _trained(config, goal)
        error = trained.errors["orbit_error"]
        if error >= config.threshold:
            raise McmjError(
                f"the free run is off the orbit by {100 * error:.3g} % "
                f"(threshold {100 * config.threshold:g} %): nothing to certify"
            )
        on_steps(1)
        return _certified(config, goal, trained, on_steps)


class _Trained(NamedTuple):
    """The loop, a state on the cycle, and the last window of a free run in MuJoCo."""

    loop: ClosedLoop
    start: Array
    outputs: Array
    errors: dict[str, float]


def _trained(config: Config, goal: Target) -> _Trained:
    body, readouts, _, stepping = limit_cycle.get_body(config.of_body)
    require_outputs(body, goal)
    simulation, w_out = Simulation(body, **stepping), readouts.get(goal.name)
    if w_out is None:
        w_out = train(
            simulation, goal, config.noise_seed, teaching=config.teaching, practice=config.practice
        ).fit.w_out
    else:
        synchronise(simulation, goal, config.teaching.washout)
        simulation.set_readout(w_out)
    last = round(config.window / simulation.timestep)
    simulation.rollout(max(1, round(config.free_run / simulation.timestep) - last), record=())
    outputs = simulation.rollout(last, record=("outputs",)).get("outputs")
    errors = cycle_errors(outputs, simulation.timestep, goal)
    loop = ClosedLoop(body, w_out, simulation.timestep, threads=os.cpu_count() or 1)
    return _Trained(loop, loop.vector(simulation.state), outputs, errors)


def _certified(config: Config, goal: Target, trained: _Trained, on_steps: OnSteps) -> Result:
    seed, copies = config.noise_seed, config.copies
    trial = Trial(recovery=config.recovery, threshold=config.threshold)
    loop = trained.loop
    cycle = _cycle(config, goal, loop, trained.start)
    analysis = floquet(loop, cycle)
    confirmed = monodromy_error(loop, cycle, analysis)
    on_steps(1)
    exponent = lyapunov_exponent(
        loop, cycle.state, interval=cycle.period, scale=cycle.scale, seed=seed
    )
    on_steps(1)
    diffusion = phase_diffusion(loop, cycle, config.diffusion_noise, seed=seed)
    on_steps(1)
    begun = scaled_starts(
        loop, goal, np.repeat(config.scales, config.phases),
        np.tile(np.arange(config.phases) / config.phases, len(config.scales)),
        duration=config.teaching.washout,
    )  # fmt: skip
    starts = _survey(config, loop, goal, begun)
    rest = loop.vector(rest_state(loop.body))[None]
    rest_recovers = bool(_survey(config, loop, goal, rest).recovered[0])
    on_steps(1)
    generator = stream(seed, "initial_state")
    hit = kicked(loop, cycle, np.repeat(config.kicks, copies), generator)
    kicks = _survey(config, loop, goal, pushed(loop, hit, None, 1.0, refine=config.refine))
    on_steps(1)
    pushes, agrees = _pushes(config, goal, loop, cycle)
    on_steps(1)
    states = on_cycle(loop, cycle, copies)
    force = force_tolerance(loop, goal, states, trial, seed=seed)
    fine = force_tolerance(loop, goal, states, trial, refine=config.refine, seed=seed)
    on_steps(1)
    noise = noise_tolerance(loop, goal, states, trial, seed=seed)
    on_steps(1)
    return Result(
        config, loop.body, goal, cycle, trained.errors, trained.outputs, analysis,
        None if goal.rhs is None else target_multipliers(goal), confirmed, exponent, diffusion,
        starts, loop.outputs(begun), rest_recovers, kicks, pushes, agrees, force, fine, noise,
    )  # fmt: skip


def _cycle(config: Config, goal: Target, loop: ClosedLoop, start: Array) -> Cycle:
    """The settled cycle, which must still be the taught one."""
    cycle = find_cycle(loop, start, goal.period)
    outputs = loop.run(cycle.state[None], round(2 * cycle.period / loop.timestep)).outputs[0]
    error = orbits.orbit_error(outputs, goal)
    if error >= config.threshold:
        raise McmjError(
            f"the loop leaves the orbit in the long run: the cycle it settles on is off by "
            f"{100 * error:.3g} % (threshold {100 * config.threshold:g} %)"
        )
    return cycle


def _survey(config: Config, loop: ClosedLoop, goal: Target, states: Array) -> Survey:
    return survey(loop, goal, states, duration=config.recovery, threshold=config.threshold)


def _pushes(
    config: Config, goal: Target, loop: ClosedLoop, cycle: Cycle
) -> tuple[Survey, tuple[int, int]]:
    """The survey of pushes, and how many of one copy a strength MuJoCo judges alike."""
    copies, nodes = config.copies, loop.body.n_nodes
    strengths = np.repeat(config.pushes, copies)
    pattern = stream(config.noise_seed, "forces").uniform(-1, 1, (len(strengths), nodes))
    forces, states = strengths[:, None] * pattern, on_cycle(loop, cycle, len(strengths))
    order = np.arange(len(strengths)).reshape(-1, copies).T.argsort(axis=None)
    states = states[order]  # every strength at phases all over the cycle
    result = _survey(config, loop, goal, pushed(loop, states, forces, 1.0, refine=config.refine))
    some = slice(None, None, copies)
    trial = Trial(1.0, config.recovery, config.threshold)
    return result, verdicts(loop, goal, states[some], forces[some], trial)
