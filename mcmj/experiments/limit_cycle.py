"""Fig. 5: one body learns a limit cycle by teacher forcing, then runs free in MuJoCo."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from mcmj import metrics
from mcmj.body import Body
from mcmj.bodyfile import body_of_model, load_model, provenance_of_model, readouts_of_model
from mcmj.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.generator import BodySettings, draw_body
from mcmj.library import body_path
from mcmj.mjcf import DEFAULT_INTEGRATOR
from mcmj.progress import OnSteps
from mcmj.readout import Fit
from mcmj.simulation import Simulation
from mcmj.targets import TARGETS, Target, target
from mcmj.teaching import Teaching, synchronise, teach
from mcmj.timing import interleaved_seconds, median_ratio
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
        require_number("free_run", self.free_run, 0.0, open_low=True)
        require_number("window", self.window, 0.0, self.free_run, open_low=True)
        if self.body is not None and self.settings != BodySettings():
            raise InvalidArgumentError(
                "settings", "none beside a body, which has its own", self.settings
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
    """

    target: Target
    w_out: Array
    fit: Fit | None
    times: Array
    outputs: Array
    positions: Array
    errors: dict[str, float]


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
    return body_of_model(model), readouts_of_model(model), provenance_of_model(model) or {}


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar."""
    seconds = config.teaching.duration + config.free_run
    return len(config.tasks) * round(seconds / config.timestep)


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach and run every task, and measure what the closed loop costs.

    Raises:
        DivergenceError: a simulation blew up.
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    body, _, source = get_body(config)
    tasks = {}
    for name, outcome in run_tasks(config, on_steps=on_steps).items():
        if isinstance(outcome, DivergenceError):
            raise outcome
        tasks[name] = outcome
    speed, ratio = closed_loop_cost(body, next(iter(tasks.values())).w_out, config)
    return Result(config, body, source, tasks, speed, ratio)


def run_tasks(
    config: Config, *, on_steps: OnSteps = lambda steps: None
) -> dict[str, TaskResult | DivergenceError]:
    """Teach and run every task, on several threads; a task that blew up is its error.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    body, readouts, _ = get_body(config)
    targets = {name: target(name) for name in config.tasks}
    for wanted in targets.values():
        _check_task(config, body, wanted)

    def outcome(name: str) -> TaskResult | DivergenceError:
        try:
            return _run_task(config, body, targets[name], readouts.get(name), on_steps)
        except DivergenceError as error:
            return error

    # rollouts release the GIL; BLAS threads on top would wait for each other
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(targets, pool.map(outcome, targets), strict=True))


def _check_task(config: Config, body: Body, wanted: Target) -> None:
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
    config: Config, body: Body, wanted: Target, w_out: Array | None, on_steps: OnSteps
) -> TaskResult:
    simulation = Simulation(body, timestep=config.timestep, integrator=config.integrator)
    fit = None
    if w_out is None:
        fit = teach(simulation, wanted, config.teaching, config.noise_seed, on_steps=on_steps)
        w_out = fit.w_out
    else:
        synchronise(simulation, wanted, config.teaching.washout)
        simulation.set_readout(w_out)
    total, last = (round(s / config.timestep) for s in (config.free_run, config.window))
    parts = []
    before = simulation.stream(total - last, record=("outputs",)) if total > last else ()
    for part in before:
        parts.append(part)
        on_steps(len(part))
    end = simulation.rollout(last, record=("outputs", "positions"))
    on_steps(last)
    outputs = end.get("outputs")
    errors = {
        "orbit_error": metrics.orbit_error(outputs, wanted),
        "period_error": metrics.relative_period_error(outputs, config.timestep, wanted),
        "amplitude_error": metrics.relative_amplitude_error(outputs, wanted),
    }
    return TaskResult(
        target=wanted,
        w_out=w_out,
        fit=fit,
        times=np.concatenate([part.times for part in (*parts, end)]),
        outputs=np.concatenate([part.get("outputs") for part in (*parts, end)]),
        positions=end.get("positions"),
        errors=errors,
    )


def closed_loop_cost(
    body: Body, w_out: Array, config: Config, *, steps: int = 4000, repeats: int = 7
) -> tuple[float, float]:
    """Steps a second in closed loop with lengths and outputs recorded, and its cost ratio.

    The ratio is the median over `repeats` of the time for `steps` control steps through
    Simulation.rollout, over the time of as many bare mj_step of the same model from the same
    state with the loop open, measured in turns.
    """
    simulation = Simulation(
        body, w_out=w_out, timestep=config.timestep, integrator=config.integrator
    )
    bare, free = mujoco.MjData(simulation.model), body.free

    def step_bare() -> None:
        state = simulation.state
        bare.qpos[:] = (state.positions - body.positions)[free].ravel()
        bare.qvel[:] = state.velocities[free].ravel()
        mujoco.mj_step(simulation.model, bare, nstep=steps)

    seconds = interleaved_seconds(
        {"closed": lambda: simulation.rollout(steps), "bare": step_bare}, repeats
    )
    speed = steps / float(np.median(seconds["closed"]))
    return speed, median_ratio(seconds, "closed", "bare")
