"""Fig. 7: from total rest the closed loop swings up onto the taught orbit."""

from dataclasses import replace

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.experiments.swing_up.config import Config
from mcmj.experiments.swing_up.result import Result, SwingUp
from mcmj.learning.free_run import free_run
from mcmj.learning.recipe import train
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.threads import in_threads
from mcmj.utils.validation import Array

# what a search over many bodies leaves out, and what it is after: see mcmj.search.experiment
SEARCH_DEFAULTS = {"kicks": 0}
SEARCH_SCORE = "tasks/*/orbit_error"


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body every task, put it to rest, close the loop, and see where it goes.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    targets = config.of_seed(0).targets
    pairs = [(config.of_seed(index), name) for index in range(config.seeds) for name in targets]
    first = pairs[0][0]
    first_found = limit_cycle.get_body(first)
    first_body = first_found[0]
    for wanted in targets.values():
        limit_cycle.check_task(first, first_body, wanted)

    def work(pair: tuple[limit_cycle.Config, str], report: OnSteps) -> SwingUp:
        one, name = pair
        body, _, _, stepping = first_found if one == first else limit_cycle.get_body(one)
        simulation = Simulation(body, **stepping)
        found = _swing_up(config, simulation, targets[name], one.noise_seed, report)
        return found if one == first else replace(found, outputs=found.outputs[:0])

    runs = iter(in_threads(work, pairs, on_steps))
    return Result(
        config, first_body, [dict(zip(targets, runs, strict=False)) for _ in range(config.seeds)]
    )


def _swing_up(
    config: Config, simulation: Simulation, wanted: Target, seed: int, on_steps: OnSteps
) -> SwingUp:
    """Readouts in body files are not used: they were taught to run, not to swing up."""
    body = simulation.body
    try:
        practised = train(
            simulation, wanted, seed, teaching=config.teaching, practice=config.practice,
            on_steps=on_steps,
        )  # fmt: skip
    except DivergenceError:
        return SwingUp(wanted, None, np.zeros((0, body.n_outputs)), np.inf, np.inf, (), None)
    outputs = _free_run(config, simulation, None, on_steps)
    speeds = stream(seed, "initial_state")
    kicked = [
        _free_run(
            config, simulation,
            config.kick_speed * speeds.standard_normal(body.positions.shape), on_steps,
        )
        for _ in range(config.kicks)
    ]  # fmt: skip
    errors = [_end_error(config, run, wanted) for run in kicked]
    return SwingUp(
        target=wanted,
        w_out=practised.fit.w_out,
        outputs=outputs,
        orbit_error=_end_error(config, outputs, wanted),
        swing_up_time=np.inf if not len(outputs) else orbits.recovery_time(
            outputs, config.timestep, wanted, tolerance=config.tolerance
        ),
        practice_errors=practised.errors,
        kicked_fraction=float(np.mean(np.array(errors) < config.tolerance)) if kicked else None,
    )  # fmt: skip


def _free_run(
    config: Config, simulation: Simulation, velocities: Array | None, on_steps: OnSteps
) -> Array:
    """Outputs (T, n_outputs) of a free run from the body's rest positions; empty if it blows up."""
    steps = round(config.free_run / config.timestep)
    simulation.reset()
    if velocities is not None:
        simulation.set_state(velocities=velocities)
    nothing = np.zeros((0, simulation.body.n_outputs))
    return or_lost(lambda: free_run(simulation, steps, on_steps=on_steps), nothing)


def _end_error(config: Config, outputs: Array, wanted: Target) -> float:
    last = outputs[-round(config.window / config.timestep) :]
    return orbits.orbit_error(last, wanted) if len(last) else np.inf
