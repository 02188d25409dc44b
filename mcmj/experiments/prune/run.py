"""Which springs must be sensed? Readouts of fewer and fewer springs, run in closed loop."""

from dataclasses import dataclass, field, replace

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.learning.held_out import closed_loop_errors, held_out_starts
from mcmj.learning.lessons import Teaching
from mcmj.learning.spring_selection import METHODS, importance, sense_only
from mcmj.learning.teaching import Course, lessons_of
from mcmj.simulation.simulation import Simulation
from mcmj.targets.named import named_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array, require_count, require_number


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, .., a .csv file or package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body, unless a seed, several seeds or changed settings ask for random ones.
        seed: of the random body and of the noise; default 0.
        seeds: number of random bodies of consecutive seeds.
        methods: orders in which springs are dropped: backward, forward, random.
        counts: numbers of springs to sense, beside all; more than there are: all.
        starts: number of held-out starts; the worst of their free runs counts.
        free_run: length of each [s].
        window: the orbit error is that of this last part [s].
        threshold: largest orbit error of a success.
        timestep: control and physics step [s].
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        teaching: how the readouts are taught.
    """

    task: str = "quadratic"
    body: str | None = None
    seed: int | None = None
    seeds: int = 1
    methods: tuple[str, ...] = tuple(METHODS)
    counts: tuple[int, ...] = (2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 22, 26, 32, 38, 45, 52, 58)
    starts: int = 3
    free_run: float = 60.0
    window: float = 20.0
    threshold: float = 0.05
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = field(default_factory=BodySettings)
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        named_target(self.task)
        for name in ("seeds", "starts"):
            require_count(name, getattr(self, name), 1)
        for method in self.methods:
            if method not in METHODS:
                raise UnknownNameError("pruning method", method, METHODS)
        for count in self.counts:
            require_count("counts", count, 1)
        if not self.methods or not self.counts:
            raise InvalidArgumentError("methods, counts", "at least one of each", "none")
        require_number("threshold", self.threshold, 0.0, open_low=True)
        self.of_seed(0)  # checks the rest

    def of_seed(self, index: int) -> limit_cycle.Config:
        """The limit-cycle experiment of the body number `index`."""
        one = limit_cycle.Config(
            task=self.task, body=self.body, seed=self.seed, free_run=self.free_run,
            window=self.window, timestep=self.timestep, engine=self.engine,
            settings=self.settings, teaching=self.teaching,
        )  # fmt: skip
        return one if self.seeds == 1 else replace(one, seed=one.noise_seed + index)


@dataclass(frozen=True)
class Pruned:
    """One body.

    Attributes:
        orders: (L,) by method: springs, the most important first.
        errors: (counts,) by method: orbit errors in closed loop, the worst over the starts.
        full_error: with all springs.
    """

    body: Body
    orders: dict[str, np.ndarray]
    errors: dict[str, Array]
    full_error: float


@dataclass(frozen=True)
class Result:
    """All bodies; the first is drawn."""

    config: Config
    bodies: list[Pruned]

    @property
    def full_errors(self) -> Array:
        """(bodies,) with all springs."""
        return np.array([body.full_error for body in self.bodies])

    def errors(self, method: str) -> Array:
        """(bodies, counts)."""
        return np.array([body.errors[method] for body in self.bodies])

    def needed(self, method: str, index: int) -> int | None:
        """Fewest springs with which a body, and with more of them too, is a success."""
        one = self.bodies[index]
        counts = np.minimum([*self.config.counts, one.body.n_springs], one.body.n_springs)
        errors = np.append(one.errors[method], one.full_error)
        order = np.argsort(counts, kind="stable")[::-1]
        good = errors[order] < self.config.threshold
        run = len(good) if good.all() else int(good.argmin())
        return int(counts[order][run - 1]) if run else None

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        n = len(self.bodies)
        table: dict[str, object] = {
            "counts": self.config.counts,
            "springs": [one.body.n_springs for one in self.bodies],
            "full_errors": self.full_errors,
        }
        for method in self.config.methods:
            errors = self.errors(method)
            table[method] = {
                "median_orbit_errors": np.median(errors, axis=0),
                "successes": (errors < self.config.threshold).sum(axis=0),
                "springs_needed": [self.needed(method, k) for k in range(n)],
                "order": self.bodies[0].orders[method],
                "orbit_errors": errors,
            }
        return table


def total_runs(config: Config) -> int:
    """Readouts to be run, for a progress bar."""
    return config.seeds * (1 + len(config.methods) * len(config.counts))


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body once, then run readouts of its most important springs alone.

    Raises:
        DivergenceError: a body blew up under the teacher.
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    return Result(
        config, [_of_body(config.of_seed(k), config, on_steps) for k in range(config.seeds)]
    )


def _of_body(one: limit_cycle.Config, config: Config, on_steps: OnSteps) -> Pruned:
    body, _, _ = limit_cycle.get_body(one)
    wanted, teaching = named_target(config.task), config.teaching
    limit_cycle.check_task(one, body, wanted)
    simulation = Simulation(body, timestep=config.timestep, engine=config.engine)
    course = Course(simulation, teaching, one.noise_seed)
    course.attend_all(lessons_of(wanted, teaching))
    regression = course.regression
    ridge = teaching.ridge_per_row * regression.weight
    starts = held_out_starts(simulation, wanted, teaching, one.noise_seed, config.starts)

    def error(springs: np.ndarray) -> float:
        readout = sense_only(regression, springs, ridge)
        on_steps(1)
        return float(
            closed_loop_errors(
                simulation, readout, starts, wanted, free_run=config.free_run, window=config.window
            ).max()
        )

    orders = {m: importance(regression, ridge, m, one.noise_seed) for m in config.methods}
    errors = {m: np.array([error(o[:n]) for n in config.counts]) for m, o in orders.items()}
    return Pruned(body, orders, errors, error(np.arange(body.n_springs)))
