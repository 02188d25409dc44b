"""Fig. 7: from total rest the closed loop swings up onto the taught orbit."""

from dataclasses import dataclass, field, replace

import numpy as np

from mcmj import metrics
from mcmj.body import Body
from mcmj.errors import DivergenceError
from mcmj.experiments import limit_cycle
from mcmj.generator import BodySettings
from mcmj.progress import OnSteps
from mcmj.rates import success_rate
from mcmj.simulation import Simulation
from mcmj.targets import Target, target
from mcmj.teaching import Teaching, teach
from mcmj.validation import Array, require_count, require_number


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all three (by the same body).
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body, unless a seed, several seeds or changed settings ask for random ones.
        seed: of the random body and of the noise; default 0.
        seeds: number of random bodies of consecutive seeds, for rates.
        free_run: length of the run from rest [s].
        window: the orbit error is that of this last part of it [s].
        tolerance: of the target orbit, over its RMS radius, for the swing-up time and for
            success.
        timestep: control and physics step [s].
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        teaching: how the readout is taught; some runs from rest help.
    """

    task: str = "all"
    body: str | None = None
    seed: int | None = None
    seeds: int = 1
    free_run: float = 80.0
    window: float = 20.0
    tolerance: float = 0.05
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = field(default_factory=BodySettings)
    teaching: Teaching = field(default_factory=lambda: Teaching(rest_runs=3))

    def __post_init__(self) -> None:
        require_count("seeds", self.seeds, 1)
        require_number("tolerance", self.tolerance, 0.0, open_low=True)
        self.of_seed(0)  # checks the rest

    def of_seed(self, index: int) -> limit_cycle.Config:
        """The limit-cycle experiment of the body number `index`."""
        one = limit_cycle.Config(
            task=self.task,
            body=self.body,
            seed=self.seed,
            free_run=self.free_run,
            window=self.window,
            timestep=self.timestep,
            settings=self.settings,
            teaching=self.teaching,
        )
        return one if self.seeds == 1 else replace(one, seed=one.noise_seed + index)


@dataclass(frozen=True)
class SwingUp:
    """One task of one body.

    Attributes:
        times, outputs: (T,) [s] and (T, n_outputs) from rest; empty if it blew up.
        orbit_error: of the last part; infinite if it blew up.
        swing_up_time: until the outputs stay within the tolerance of the orbit [s], infinite
            if they do not.
    """

    target: Target
    times: Array
    outputs: Array
    orbit_error: float
    swing_up_time: float


@dataclass(frozen=True)
class Result:
    """All bodies, each a dictionary by task; the first is drawn."""

    config: Config
    bodies: list[dict[str, SwingUp]]

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the worst task of the first body, each task, rates."""
        first = self.bodies[0]
        table: dict[str, object] = {
            "orbit_error": max(task.orbit_error for task in first.values()),
            "swing_up_time": max(task.swing_up_time for task in first.values()),
            "tasks": {
                name: {"orbit_error": task.orbit_error, "swing_up_time": task.swing_up_time}
                for name, task in first.items()
            },
        }
        if self.config.seeds > 1:
            table["seeds"] = self.rates
        return table

    @property
    def rates(self) -> dict[str, dict[str, object]]:
        """How many bodies swing up, by task and on all tasks."""
        errors = {n: [body[n].orbit_error for body in self.bodies] for n in self.bodies[0]}
        good = {name: np.array(e) < self.config.tolerance for name, e in errors.items()}
        table = {
            name: {
                **success_rate(good[name]),
                "median_swing_up_time": float(
                    np.median([body[name].swing_up_time for body in self.bodies])
                ),
                "orbit_errors": errors[name],
            }
            for name in errors
        }
        table["all_tasks"] = success_rate(np.logical_and.reduce(list(good.values())))
        return table


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar."""
    teaching = config.teaching
    taught = teaching.duration + teaching.rest_runs * teaching.rest_duration
    seconds = taught + config.free_run
    return config.seeds * len(config.of_seed(0).tasks) * round(seconds / config.timestep)


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body every task, put it to rest, close the loop, and see where it goes.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    bodies = []
    for index in range(config.seeds):
        one = config.of_seed(index)
        body, _, _ = limit_cycle.get_body(one)
        tasks = {name: target(name) for name in one.tasks}
        for wanted in tasks.values():
            limit_cycle.check_task(one, body, wanted)
        seed = one.noise_seed
        bodies.append({n: _swing_up(config, body, w, seed, on_steps) for n, w in tasks.items()})
    return Result(config, bodies)


def _swing_up(config: Config, body: Body, wanted: Target, seed: int, on_steps: OnSteps) -> SwingUp:
    """Readouts in body files are not used: they were taught to run, not to swing up."""
    simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
    parts = []
    try:
        teach(simulation, wanted, config.teaching, seed, on_steps=on_steps)
        simulation.reset()
        for part in simulation.stream(
            round(config.free_run / config.timestep), record=("outputs",)
        ):
            parts.append(part.get("outputs"))
            on_steps(len(part))
    except DivergenceError:
        return SwingUp(wanted, np.zeros(0), np.zeros((0, 2)), np.inf, np.inf)
    outputs = np.concatenate(parts)
    return SwingUp(
        target=wanted,
        times=np.arange(len(outputs), dtype=np.float64) * config.timestep,
        outputs=outputs,
        orbit_error=metrics.orbit_error(outputs[-round(config.window / config.timestep) :], wanted),
        swing_up_time=metrics.recovery_time(
            outputs, config.timestep, wanted, tolerance=config.tolerance
        ),
    )
