"""Fig. 5: one body learns a limit cycle by teacher forcing, then runs free in MuJoCo."""

import hashlib
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.experiments.blow_ups import finer
from mcmj.experiments.limit_cycle.config import Config, Found, check_task, get_body
from mcmj.experiments.limit_cycle.loop_cost import closed_loop_cost
from mcmj.experiments.limit_cycle.result import Result, TaskResult
from mcmj.experiments.limit_cycle.seeds import SuccessOfSeeds
from mcmj.learning.free_run import free_run, resume, window_errors
from mcmj.learning.recipe import train, training_time
from mcmj.learning.regression import Fit
from mcmj.learning.teaching import synchronise
from mcmj.metrics import orbits
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.checkpoint import Checkpoint
from mcmj.utils.errors import DivergenceError
from mcmj.utils.files import only_run
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads
from mcmj.utils.validation import Array

# what a search over many bodies leaves out, see mcmj.search.experiment
SEARCH_DEFAULTS = {"windows": 0.0, "measure_cost": False}

Outcomes = dict[str, TaskResult | DivergenceError]


def checkpoints(config: Config, folder: Path, found: Found) -> dict[str, Checkpoint]:
    """Where the free runs of a config keep what they need to go on, one a task."""
    body, readouts, _, stepping = found
    integrator = stepping.get("integrator", DEFAULT_INTEGRATOR)
    xml = to_mjcf(body, readouts=readouts, integrator=integrator).encode()

    def account(wanted: Target) -> list[object]:
        orbit = wanted.orbit(orbits.ORBIT_POINTS)  # a file may have changed under the same name
        return [config, hashlib.sha256(xml + orbit.tobytes()).hexdigest()]

    return {
        name: Checkpoint(folder / f".checkpoint-{name}", account(wanted), body.n_outputs)
        for name, wanted in config.targets.items()
    }


def run(
    config: Config, *, folder: Path | None = None, on_steps: OnSteps = lambda steps: None
) -> Result:
    """Teach and run every task, and measure what the closed loop costs.

    Args:
        folder: where checkpoints are kept, and gone on from, by one run at a time; see
            Result.remove_checkpoints.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: a simulation blew up.
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
        CheckpointError: a checkpoint is damaged.
        OutputError: another run is at work in the folder, or it cannot be written.
    """
    with nullcontext() if folder is None else only_run(folder):
        (body, _, source, stepping), kept, outcomes = _of_body(config, folder, on_steps)
    tasks = {}
    for name, outcome in outcomes.items():
        if not isinstance(outcome, DivergenceError):
            tasks[name] = outcome
        elif config.seeds == 1:
            raise outcome
    speed = ratio = None
    if config.measure_cost and tasks:
        w_out = next(iter(tasks.values())).w_out
        speed, ratio = closed_loop_cost(body, w_out, stepping)
    seeds = _over_seeds(config, outcomes, on_steps) if config.seeds > 1 else None
    return Result(config, body, source, stepping, tasks, kept, speed, ratio, seeds)


def _of_body(
    config: Config, folder: Path | None, on_steps: OnSteps
) -> tuple[Found, dict[str, Checkpoint], Outcomes]:
    """All tasks of one body; where it blows up, from anew with finer time steps."""
    for one in finer(config):
        found = get_body(one)
        kept = {} if folder is None else checkpoints(one, folder, found)
        outcomes = run_tasks(one, found, kept, on_steps=on_steps)
        if not any(isinstance(outcome, DivergenceError) for outcome in outcomes.values()):
            break
    return found, kept, outcomes


def _over_seeds(config: Config, first: Outcomes, on_steps: OnSteps) -> SuccessOfSeeds:
    """The outcomes of all bodies; one that blows up is a failure."""
    found = [_error_pairs(first)]
    for seed in range(config.noise_seed + 1, config.noise_seed + config.seeds):
        _, _, outcomes = _of_body(replace(config, seed=seed, seeds=1), None, on_steps)
        found.append(_error_pairs(outcomes))
    errors = {name: np.array([pairs[name] for pairs in found]) for name in config.targets}
    return SuccessOfSeeds(
        config.noise_seed,
        config.threshold,
        {name: pairs[:, 0] for name, pairs in errors.items()},
        {name: pairs[:, 1] for name, pairs in errors.items()},
    )


def _error_pairs(outcomes: Outcomes) -> dict[str, tuple[float, float]]:
    """Orbit and period errors by task; infinite where the body blew up."""
    return {
        name: (np.inf, np.inf)
        if isinstance(outcome, DivergenceError)
        else (outcome.errors["orbit_error"], outcome.errors["period_error"])
        for name, outcome in outcomes.items()
    }


def run_tasks(
    config: Config,
    found: Found,
    kept: Mapping[str, Checkpoint] = {},
    *,
    on_steps: OnSteps = lambda steps: None,
) -> Outcomes:
    """Teach and run every task, on several threads; a task that blew up is its error.

    Args:
        found: what `get_body` gave.
        kept: of `checkpoints`, to go on from.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    body, readouts, _, stepping = found
    targets = config.targets
    for wanted in targets.values():
        check_task(config, body, wanted)

    def outcome(name: str, report: OnSteps) -> TaskResult | DivergenceError:
        try:
            return _run_task(
                config, Simulation(body, **stepping), targets[name], readouts.get(name),
                kept.get(name), report,
            )  # fmt: skip
        except DivergenceError as error:
            return error

    return dict(zip(targets, in_threads(outcome, list(targets), on_steps), strict=True))


def _run_task(
    config: Config,
    simulation: Simulation,
    wanted: Target,
    w_out: Array | None,
    checkpoint: Checkpoint | None,
    on_steps: OnSteps,
) -> TaskResult:
    resumed = None if checkpoint is None else resume(simulation, checkpoint)
    if resumed is None:
        done, fit = None, _ready(simulation, config, wanted, w_out, on_steps)
    else:
        done, fit = resumed
        taught = training_time(wanted, config.teaching, config.practice)
        on_steps(round(taught / config.timestep) + len(done))
    total, last = (round(s / config.timestep) for s in (config.free_run, config.window))
    first = free_run(
        simulation, total - last, done=done, checkpoint=checkpoint, fit=fit, on_steps=on_steps
    )
    seen = ("positions",) if config.engine != "twin" else ()
    end = simulation.rollout(last, record=("outputs", *seen))
    on_steps(last)
    outputs = np.concatenate([first, end.get("outputs")])
    readout = simulation.w_out
    assert readout is not None
    start = round(simulation.time / config.timestep) - total
    return TaskResult(
        target=wanted,
        w_out=readout,
        fit=fit,
        times=config.timestep * np.arange(start, start + total, dtype=np.float64),
        outputs=outputs,
        positions=end.positions,
        errors=cycle_errors(outputs[-last:], config.timestep, wanted),
        windows=(
            window_errors(outputs, config.timestep, wanted, length=config.windows)
            if config.windows
            else {}
        ),
    )


def _ready(
    simulation: Simulation,
    config: Config,
    wanted: Target,
    w_out: Array | None,
    on_steps: OnSteps,
) -> Fit | None:
    """Teach, or bring onto the target a body that has its readout already."""
    if w_out is None:
        return train(
            simulation, wanted, config.noise_seed, teaching=config.teaching,
            practice=config.practice, on_steps=on_steps,
        ).fit  # fmt: skip
    synchronise(simulation, wanted, config.teaching.washout)
    simulation.set_readout(w_out)
    return None


def cycle_errors(outputs: Array, timestep: float, wanted: Target) -> dict[str, float]:
    """Orbit, period and amplitude errors of outputs (T, n_outputs), see mcmj.metrics.orbits."""
    return {
        "orbit_error": orbits.orbit_error(outputs, wanted),
        "period_error": orbits.relative_period_error(outputs, timestep, wanted),
        "amplitude_error": orbits.relative_amplitude_error(outputs, wanted),
    }
