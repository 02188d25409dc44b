"""Fig. 6: a taught rhythm is disturbed for a while, and comes back."""

from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.blow_ups import finer, or_lost
from mcmj.experiments.perturb.config import Config
from mcmj.experiments.perturb.result import LOST, Recovery, Result, TaskResult
from mcmj.learning.recipe import train
from mcmj.metrics import orbits
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads

# what a search over many bodies leaves out, see mcmj.search.experiment
SEARCH_DEFAULTS = {"noise_curve": ()}


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body, disturb it in every way, and measure how it comes back.

    Raises:
        InvalidArgumentError: a body without as many outputs as the task has.
    """
    seeds, targets = config.source.all_seeds, config.targets
    first, _ = get_body(config, seeds[0])
    for wanted in targets.values():
        require_outputs(first, wanted)
    pairs = [(seed, name) for seed in seeds for name in targets]

    def work(pair: tuple[int, str], report: OnSteps) -> TaskResult:
        seed, name = pair
        for one in finer(config):
            found = or_lost(
                lambda: _of_task(one, seed, targets[name], seed == seeds[0], report),  # noqa: B023
                _lost(config),
            )
            if not found.blew_up:
                break
        return found

    runs = iter(in_threads(work, pairs, on_steps))
    return Result(config, first, [dict(zip(targets, runs, strict=False)) for _ in seeds])


def get_body(config: Config, seed: int) -> tuple[Body, dict[str, Any]]:
    """The body of a seed, or the config's, and the arguments of its Simulation."""
    stored = config.source.get(seed)
    names = ("springs",) if config.engine != "twin" else ()
    return stored.body, stored.take(*names, timestep=config.timestep, engine=config.engine)


def _lost(config: Config) -> TaskResult:
    """What a body that blew up under the teacher leaves."""
    recoveries = dict.fromkeys(config.perturbations, LOST)
    return TaskResult(None, np.inf, recoveries, np.full(len(config.noise_curve), np.inf))


def _of_task(
    config: Config, seed: int, wanted: Target, whole: bool, on_steps: OnSteps
) -> TaskResult:
    """One task of one body.

    Args:
        whole: keep the outputs.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    body, stepping = get_body(config, seed)
    simulation = Simulation(body, **stepping)
    curve = [Phase(config.window, length_noise=std) for std in config.noise_curve]
    w_out = train(
        simulation, wanted, seed, teaching=config.teaching, practice=config.practice,
        on_steps=on_steps,
    ).fit.w_out  # fmt: skip
    start = simulation.snapshot()

    def after(phase: Phase) -> Recovery:
        simulation.restore(start)
        found = disturb(config, simulation, phase, seed, wanted, on_steps)
        return found if whole else found.judged

    return TaskResult(
        w_out=w_out,
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
