"""Fig. 5: one body learns a limit cycle by teacher forcing, then runs free in MuJoCo."""

import hashlib
import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Event

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from mcmj import metrics
from mcmj.body import Body
from mcmj.bodyfile import (
    body_of_model,
    load_model,
    provenance_of_model,
    readout_of_model,
    readouts_of_model,
    spring_law_of_model,
)
from mcmj.checkpoint import Checkpoint
from mcmj.errors import DivergenceError, InvalidArgumentError, McmjWarning, UnknownNameError
from mcmj.experiments.loop_cost import closed_loop_cost
from mcmj.freerun import free_run, resume, window_errors
from mcmj.generator import BodySettings, draw_body
from mcmj.library import body_path
from mcmj.mjcf import DEFAULT_INTEGRATOR, to_mjcf
from mcmj.progress import OnSteps
from mcmj.readout import Fit
from mcmj.simulation import Simulation
from mcmj.spring_laws import NATIVE
from mcmj.targets import TARGETS, Target, target
from mcmj.teaching import Teaching, synchronise, teach
from mcmj.validation import Array, require_number


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all three (by the same body).
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body, unless a seed or changed settings ask for a new random one. If the file
            holds a readout for the task, nothing is taught.
        seed: of the random body and of the noise; default 0.
        free_run: length of the free run in closed loop [s].
        window: the errors are those of this last part of it [s].
        timestep: control and physics step [s].
        integrator: one of MuJoCo's.
        settings: what a random body is drawn from.
        teaching: how the readout is taught.
    """

    task: str = "all"
    body: str | None = None
    seed: int | None = None
    free_run: float = 120.0
    window: float = 20.0
    timestep: float = 1e-3
    integrator: str = DEFAULT_INTEGRATOR
    settings: BodySettings = field(default_factory=BodySettings)
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        if self.task not in (*TARGETS, "all"):
            raise UnknownNameError("task", self.task, [*TARGETS, "all"])
        require_number("timestep", self.timestep, 0.0, open_low=True)
        require_number("free_run", self.free_run, 0.0, open_low=True)
        require_number("window", self.window, 0.0, self.free_run, open_low=True)
        if self.body is not None and self.settings != BodySettings():
            changed = [
                k for k, v in asdict(BodySettings()).items() if getattr(self.settings, k) != v
            ]
            raise InvalidArgumentError(
                ", ".join(changed), "no settings beside a body, which has its own", self.body
            )

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the targets to learn."""
        return tuple(TARGETS) if self.task == "all" else (self.task,)

    @property
    def noise_seed(self) -> int:
        """The seed, or its default."""
        return 0 if self.seed is None else self.seed


@dataclass(frozen=True)
class TaskResult:
    """One task: the fit (None if the readout came with the file), the free run, its errors.

    Attributes:
        times, outputs: (T,) [s] and (T, n_outputs) of the free run; its time goes on from
            teacher forcing, so the target's value at the same moment is target.sample(times).
        positions: (window, N, 2) of the nodes during the last window [m].
        windows: errors in consecutive windows, see mcmj.freerun.window_errors.
    """

    target: Target
    w_out: Array
    fit: Fit | None
    times: Array
    outputs: Array
    positions: Array
    errors: dict[str, float]
    windows: dict[str, object]


@dataclass(frozen=True)
class Result:
    """All tasks of one body, and what the closed loop costs."""

    config: Config
    body: Body
    source: dict[str, object]
    tasks: dict[str, TaskResult]
    steps_per_second: float
    closed_loop_cost_ratio: float

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {}
        for name, task in self.tasks.items():
            fit = task.fit
            table[name] = {
                **task.errors,
                "train_nrmse": fit.train_nrmse if fit else None,
                "condition_number": fit.condition_number if fit else None,
                "windows": task.windows,
            }
        table["steps_per_second"] = self.steps_per_second
        table["closed_loop_cost_ratio"] = self.closed_loop_cost_ratio
        return table


def get_body(config: Config) -> tuple[Body, dict[str, Array], dict[str, object]]:
    """The config's body, the readouts that came with it, and where it comes from."""
    if config.body is None and (config.seed is not None or config.settings != BodySettings()):
        body = draw_body(config.noise_seed, config.settings)
        return body, {}, {"seed": config.noise_seed, "settings": asdict(config.settings)}
    model = load_model(body_path(config.body or "general"))
    _warn_if_other_physics(config, model)
    body, readouts = body_of_model(model), readouts_of_model(model)
    active = readout_of_model(model)
    if not readouts and active is not None and config.task != "all":
        readouts = {config.task: active}
    return body, readouts, provenance_of_model(model) or {}


def _warn_if_other_physics(config: Config, model: mujoco.MjModel) -> None:
    """A file may have been written for another step, integrator or spring law than is run."""
    springs, step = spring_law_of_model(model), float(model.opt.timestep)
    if springs != NATIVE or step != config.timestep:
        warnings.warn(
            f"the body file was written for {1e3 * step:g} ms and {springs} springs; this run "
            f"takes {1e3 * config.timestep:g} ms, {config.integrator} and native springs",
            McmjWarning,
            stacklevel=2,
        )


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar."""
    seconds = config.teaching.duration + config.free_run
    return len(config.tasks) * round(seconds / config.timestep)


def checkpoints(config: Config, folder: Path) -> dict[str, Checkpoint]:
    """Where the free runs of a config keep what they need to go on, one a task."""
    body, readouts, _ = get_body(config)
    digest = hashlib.sha256(to_mjcf(body, readouts=readouts).encode()).hexdigest()
    return {
        name: Checkpoint(folder / f".checkpoint-{name}", [config, digest], body.n_outputs)
        for name in config.tasks
    }


def run(
    config: Config, *, folder: Path | None = None, on_steps: OnSteps = lambda steps: None
) -> Result:
    """Teach and run every task, and measure what the closed loop costs.

    Args:
        folder: where checkpoints are kept, and gone on from; `checkpoints` removes them.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: a simulation blew up.
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    body, _, source = get_body(config)
    tasks = {}
    for name, outcome in run_tasks(config, folder=folder, on_steps=on_steps).items():
        if isinstance(outcome, DivergenceError):
            raise outcome
        tasks[name] = outcome
    w_out = next(iter(tasks.values())).w_out
    speed, ratio = closed_loop_cost(
        body, w_out, timestep=config.timestep, integrator=config.integrator
    )
    return Result(config, body, source, tasks, speed, ratio)


def run_tasks(
    config: Config, *, folder: Path | None = None, on_steps: OnSteps = lambda steps: None
) -> dict[str, TaskResult | DivergenceError]:
    """Teach and run every task, on several threads; a task that blew up is its error.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    body, readouts, _ = get_body(config)
    kept = {} if folder is None else checkpoints(config, folder)
    stopped = Event()
    targets = {name: target(name) for name in config.tasks}
    for wanted in targets.values():
        check_task(config, body, wanted)

    def on_part(steps: int) -> None:
        if stopped.is_set():
            raise InterruptedError
        on_steps(steps)

    def outcome(name: str) -> TaskResult | DivergenceError:
        try:
            return _run_task(
                config, body, targets[name], readouts.get(name), kept.get(name), on_part
            )
        except DivergenceError as error:
            return error

    # rollouts release the GIL; BLAS threads on top would wait for each other
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            return dict(zip(targets, pool.map(outcome, targets), strict=True))
        except BaseException:
            stopped.set()  # the other tasks end with their chunk
            raise


def check_task(config: Config, body: Body, wanted: Target) -> None:
    """Check that a body has the channels, and the window the length, that a target needs.

    Raises:
        InvalidArgumentError: one of them does not.
    """
    if body.n_outputs != wanted.n_outputs:
        raise InvalidArgumentError(
            "body", f"{wanted.n_outputs} feedback channels for {wanted.name}", body.n_outputs
        )
    if config.window < metrics.PERIODS_NEEDED * wanted.period:
        raise InvalidArgumentError(
            "window",
            f"at least {metrics.PERIODS_NEEDED} periods of {wanted.period:.4g} s ({wanted.name})",
            f"{config.window:g} s",
        )


def _run_task(
    config: Config,
    body: Body,
    wanted: Target,
    w_out: Array | None,
    checkpoint: Checkpoint | None,
    on_steps: OnSteps,
) -> TaskResult:
    simulation = Simulation(body, timestep=config.timestep, integrator=config.integrator)
    resumed = None if checkpoint is None else resume(simulation, checkpoint)
    if resumed is None:
        done, fit = None, _ready(simulation, config, wanted, w_out, on_steps)
    else:
        done, fit = resumed
        on_steps(round(config.teaching.duration / config.timestep) + len(done))
    total, last = (round(s / config.timestep) for s in (config.free_run, config.window))
    first = free_run(
        simulation, total - last, done=done, checkpoint=checkpoint, fit=fit, on_steps=on_steps
    )
    end = simulation.rollout(last, record=("outputs", "positions"))
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
        positions=end.get("positions"),
        errors=_errors(outputs[-last:], config.timestep, wanted),
        windows=window_errors(outputs, config.timestep, wanted),
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
        return teach(simulation, wanted, config.teaching, config.noise_seed, on_steps=on_steps)
    synchronise(simulation, wanted, config.teaching.washout)
    simulation.set_readout(w_out)
    return None


def _errors(outputs: Array, timestep: float, wanted: Target) -> dict[str, float]:
    return {
        "orbit_error": metrics.orbit_error(outputs, wanted),
        "period_error": metrics.relative_period_error(outputs, timestep, wanted),
        "amplitude_error": metrics.relative_amplitude_error(outputs, wanted),
    }
