"""Fig. 7: from total rest the closed loop swings up onto the taught orbit."""

from dataclasses import dataclass, field, replace

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice, practise
from mcmj.learning.teaching import Course, lessons_of
from mcmj.metrics import orbits
from mcmj.metrics.success_rates import success_rate
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.threads import in_threads
from mcmj.utils.validation import Array, require_count, require_number

# what a search over many bodies leaves out, and what it is after: see mcmj.search.experiment
SEARCH_DEFAULTS = {"kicks": 0}
SEARCH_SCORE = "tasks/*/orbit_error"

TAUGHT = Teaching(duration=240.0, rest_runs=2, rest_duration=30.0, rest_weight=1e-2)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all of these (by the same body); a gait; a .csv
            file; package.module:function.
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
        kicks: number of further starts, with the nodes kicked, that show how wide the way
            onto the orbit is; 0: none.
        kick_speed: standard deviation of their first velocities [m/s]; on the orbit nodes move
            at about 0.05 m/s.
        settings: what a random body is drawn from.
        teaching: how the readout is taught, runs from rest included.
        practice: how the body then practises from rest.
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
    kicks: int = 8
    kick_speed: float = 0.02
    settings: BodySettings = field(default_factory=BodySettings)
    teaching: Teaching = field(default_factory=lambda: TAUGHT)
    practice: Practice = field(default_factory=Practice)

    def __post_init__(self) -> None:
        require_count("seeds", self.seeds, 1)
        require_count("kicks", self.kicks, 0)
        require_number("kick_speed", self.kick_speed, 0.0)
        require_number("tolerance", self.tolerance, 0.0, open_low=True)
        if self.body is not None and self.seeds > 1:
            raise InvalidArgumentError("seeds", "1 beside a body", self.seeds)
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
        outputs: (T, n_outputs) from rest, one every timestep; empty if it blew up.
        orbit_error: of the last part; infinite if it blew up.
        swing_up_time: until the outputs stay within the tolerance of the orbit [s], infinite
            if they do not.
        w_out: the readout after practice; None if teaching blew up.
        practice_errors: of the trials, see mcmj.learning.practice; empty if teaching blew up.
        kicked_fraction: of the kicked starts, that came to the orbit; None without any.
    """

    target: Target
    w_out: Array | None
    outputs: Array
    orbit_error: float
    swing_up_time: float
    practice_errors: tuple[float, ...]
    kicked_fraction: float | None


@dataclass(frozen=True)
class Result:
    """The first body; the results of all, each a dictionary by task; the first is drawn."""

    config: Config
    body: Body
    bodies: list[dict[str, SwingUp]]

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readouts by task, of those that were taught."""
        tasks = self.bodies[0].items()
        return {name: task.w_out for name, task in tasks if task.w_out is not None}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the worst task of the first body, each task, rates."""
        first = self.bodies[0]
        table: dict[str, object] = {
            "orbit_error": max(task.orbit_error for task in first.values()),
            "swing_up_time": max(task.swing_up_time for task in first.values()),
            "tasks": {
                name: {
                    "orbit_error": task.orbit_error,
                    "swing_up_time": task.swing_up_time,
                    "practice_errors": task.practice_errors,
                    "kicked_fraction": task.kicked_fraction,
                }
                for name, task in first.items()
            },
        }
        if self.config.seeds > 1:
            table["seeds"] = self.rates
        return table

    @property
    def rates(self) -> dict[str, dict[str, object]]:
        """How many bodies swing up, by task and on all tasks."""
        by_task = {name: [body[name] for body in self.bodies] for name in self.bodies[0]}
        table = {name: self._rate(runs) for name, runs in by_task.items()}
        good = [
            all(run.orbit_error < self.config.tolerance for run in body.values())
            for body in self.bodies
        ]
        table["all_tasks"] = success_rate(good)
        return table

    def _rate(self, runs: list[SwingUp]) -> dict[str, object]:
        tolerance = self.config.tolerance
        firsts = [run.practice_errors[0] if run.practice_errors else np.inf for run in runs]
        kicked = [run.kicked_fraction for run in runs if run.kicked_fraction is not None]
        return {
            **success_rate([run.orbit_error < tolerance for run in runs]),
            "without_practice": success_rate([error < tolerance for error in firsts]),
            "median_swing_up_time": float(np.median([run.swing_up_time for run in runs])),
            "mean_kicked_fraction": float(np.mean(kicked)) if kicked else None,
            "orbit_errors": [run.orbit_error for run in runs],
            "rounds": [max(0, len(run.practice_errors) - 1) for run in runs],
            "kicked_fractions": kicked,
        }


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar; rounds of practice are not foreseen."""
    seconds = config.teaching.total + config.practice.trial + (1 + config.kicks) * config.free_run
    return config.seeds * len(config.of_seed(0).targets) * round(seconds / config.timestep)


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body every task, put it to rest, close the loop, and see where it goes.

    Raises:
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    targets = config.of_seed(0).targets
    pairs = [(config.of_seed(index), name) for index in range(config.seeds) for name in targets]
    first = pairs[0][0]
    first_body, _, _ = limit_cycle.get_body(first)
    for wanted in targets.values():
        limit_cycle.check_task(first, first_body, wanted)

    def work(pair: tuple[limit_cycle.Config, str], report: OnSteps) -> SwingUp:
        one, name = pair
        body = first_body if one == first else limit_cycle.get_body(one)[0]
        return _swing_up(config, body, targets[name], one.noise_seed, report)

    runs = iter(in_threads(work, pairs, on_steps))
    return Result(
        config, first_body, [dict(zip(targets, runs, strict=False)) for _ in range(config.seeds)]
    )


def _swing_up(config: Config, body: Body, wanted: Target, seed: int, on_steps: OnSteps) -> SwingUp:
    """Readouts in body files are not used: they were taught to run, not to swing up."""
    simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
    course = Course(simulation, config.teaching, seed)
    try:
        course.attend_all(lessons_of(wanted, config.teaching), on_steps=on_steps)
    except DivergenceError:
        return SwingUp(wanted, None, np.zeros((0, body.n_outputs)), np.inf, np.inf, (), None)
    practised = practise(course, wanted, config.practice, on_steps=on_steps)
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
    try:
        return simulation.rollout(steps, record=("outputs",)).get("outputs")
    except DivergenceError:
        return np.zeros((0, simulation.body.n_outputs))
    finally:
        on_steps(steps)


def _end_error(config: Config, outputs: Array, wanted: Target) -> float:
    last = outputs[-round(config.window / config.timestep) :]
    return orbits.orbit_error(last, wanted) if len(last) else np.inf
