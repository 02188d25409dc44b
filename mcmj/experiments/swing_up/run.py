"""Fig. 7: from total rest the closed loop swings up onto the taught orbit."""

from dataclasses import replace

import numpy as np

from mcmj.experiments.blow_ups import or_lost, with_finer_steps
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.experiments.swing_up.config import Config
from mcmj.experiments.swing_up.result import Result, SwingUp
from mcmj.learning.free_run import free_run
from mcmj.learning.recipe import train
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
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
    pairs = [(index, name) for index in range(config.seeds) for name in targets]
    first_body = limit_cycle.get_body(config.of_seed(0))[0]
    for wanted in targets.values():
        limit_cycle.check_task(config.of_seed(0), first_body, wanted)

    def work(pair: tuple[int, str], report: OnSteps) -> SwingUp:
        index, name = pair

        def learned(one: Config) -> SwingUp:
            return _swing_up(one, index, targets[name], report)

        lost = _lost(targets[name])
        found = or_lost(lambda: with_finer_steps(learned, config), lost)
        return found if index == 0 else replace(found, outputs=lost.outputs)

    runs = iter(in_threads(work, pairs, on_steps))
    return Result(
        config, first_body, [dict(zip(targets, runs, strict=False)) for _ in range(config.seeds)]
    )


def _lost(wanted: Target) -> SwingUp:
    """What a body that blew up leaves."""
    return SwingUp(wanted, None, np.nan, np.zeros((0, wanted.n_outputs)), np.inf, np.inf, (), None)


def _swing_up(config: Config, index: int, wanted: Target, on_steps: OnSteps) -> SwingUp:
    """One body. Readouts in body files are not used: they were taught to run, not to swing up.

    Raises:
        DivergenceError: it blew up under the teacher or from rest.
    """
    of_body = config.of_seed(index)
    body, _, _, stepping = limit_cycle.get_body(of_body)
    simulation, seed = Simulation(body, **stepping), of_body.noise_seed
    practised = train(
        simulation, wanted, seed, teaching=config.teaching, practice=config.practice,
        on_steps=on_steps,
    )  # fmt: skip
    outputs = _free_run(config, simulation, None, on_steps)
    speeds = stream(seed, "initial_state")

    def kicked_error() -> float:
        velocities = config.kick_speed * speeds.standard_normal(body.positions.shape)
        return _end_error(config, _free_run(config, simulation, velocities, on_steps), wanted)

    errors = [or_lost(kicked_error, np.inf) for _ in range(config.kicks)]
    return SwingUp(
        target=wanted,
        w_out=practised.fit.w_out,
        timestep=simulation.timestep,
        outputs=outputs,
        orbit_error=_end_error(config, outputs, wanted),
        swing_up_time=orbits.recovery_time(
            outputs, config.timestep, wanted, tolerance=config.tolerance
        ),
        practice_errors=practised.errors,
        kicked_fraction=float(np.mean(np.array(errors) < config.tolerance)) if errors else None,
    )


def _free_run(
    config: Config, simulation: Simulation, velocities: Array | None, on_steps: OnSteps
) -> Array:
    """Outputs (T, n_outputs) of a free run from the body's rest positions."""
    steps = round(config.free_run / config.timestep)
    simulation.reset()
    if velocities is not None:
        simulation.set_state(velocities=velocities)
    return free_run(simulation, steps, on_steps=on_steps)


def _end_error(config: Config, outputs: Array, wanted: Target) -> float:
    return orbits.orbit_error(outputs[-round(config.window / config.timestep) :], wanted)
