"""Fig. 6: a taught rhythm is disturbed for a while, and comes back."""

from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.perturb.config import Config
from mcmj.experiments.perturb.result import LOST, BodyResult, Recovery, Result
from mcmj.learning.teaching import teach
from mcmj.metrics import orbits
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target, require_outputs
from mcmj.utils.progress import OnSteps

# what a search over many bodies leaves out, see mcmj.search.experiment
SEARCH_DEFAULTS = {"noise_curve": ()}


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body, disturb it in every way, and measure how it comes back.

    Raises:
        InvalidArgumentError: a body without as many outputs as the task has.
    """
    wanted = named_target(config.task)
    seeds = config.source.all_seeds
    return Result(config, wanted, [_of_body(config, seed, wanted, on_steps) for seed in seeds])


def get_body(config: Config, seed: int) -> tuple[Body, dict[str, object], dict[str, Any]]:
    """The body of a seed, or the config's; where it comes from; arguments of its Simulation."""
    stored = config.source.get(seed)
    names = ("springs",) if config.engine != "twin" else ()
    stepping = stored.take(*names, timestep=config.timestep, engine=config.engine)
    return stored.body, stored.provenance, stepping


def _of_body(config: Config, seed: int, wanted: Target, on_steps: OnSteps) -> BodyResult:
    body, source, settings = get_body(config, seed)
    require_outputs(body, wanted)
    simulation = Simulation(body, **settings)
    curve = [Phase(config.window, length_noise=std) for std in config.noise_curve]
    fit = or_lost(lambda: teach(simulation, wanted, config.teaching, seed, on_steps=on_steps), None)
    if fit is None:
        lost = dict.fromkeys(config.perturbations, LOST)
        return BodyResult(body, source, None, np.inf, lost, np.full(len(curve), np.inf))
    start = simulation.snapshot()

    def after(phase: Phase) -> Recovery:
        simulation.restore(start)
        return disturb(config, simulation, phase, seed, wanted, on_steps)

    return BodyResult(
        body=body,
        source=source,
        fit=fit,
        unperturbed_error=after(Phase(config.window)).orbit_error,
        recoveries={name: after(phase) for name, phase in config.perturbations.items()},
        noise_errors=np.array([after(phase).orbit_error for phase in curve]),
    )


def disturb(
    config: Config,
    simulation: Simulation,
    phase: Phase,
    seed: int,
    wanted: Target,
    on_steps: OnSteps = lambda steps: None,
) -> Recovery:
    """Run free, disturbed and free again; a body that blows up has not recovered."""
    schedule = Schedule([Phase(config.before), phase, Phase(config.after)])
    run = or_lost(lambda: run_schedule(simulation, schedule, seed, on_steps=on_steps), None)
    if run is None:
        return LOST
    free = run.feedback[run.phase(-1)]
    last = free[-round(config.error_window / config.timestep) :]
    return Recovery(
        times=run.trajectory.times - run.trajectory.times[0],
        outputs=run.feedback,
        clean=run.trajectory.get("outputs"),
        boundaries=run.boundaries,
        orbit_error=orbits.orbit_error(last, wanted),
        recovery_time=orbits.recovery_time(
            free, config.timestep, wanted, tolerance=config.tolerance
        ),
    )
