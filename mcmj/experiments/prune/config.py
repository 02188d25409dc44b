"""What the pruning experiment runs: its Config."""

from dataclasses import dataclass

from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.learning.lessons import Teaching
from mcmj.learning.recipe import BODIES, TEACHING
from mcmj.learning.spring_selection import METHODS
from mcmj.targets.named import named_target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_name, require_number


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
    settings: BodySettings = BODIES
    teaching: Teaching = TEACHING

    def __post_init__(self) -> None:
        named_target(self.task)
        require_count("starts", self.starts, 1)
        require_name("pruning method", METHODS, *self.methods)
        for count in self.counts:
            require_count("counts", count, 1)
        if not self.methods or not self.counts:
            raise InvalidArgumentError("methods, counts", "at least one of each", "none")
        require_number("threshold", self.threshold, 0.0, open_low=True)
        self.of_seed(0)  # checks the rest

    def of_seed(self, index: int) -> limit_cycle.Config:
        """The limit-cycle experiment of the body number `index`."""
        return limit_cycle.of_seed(self, index)


def total_runs(config: Config) -> int:
    """Readouts to be run, for a progress bar."""
    return config.seeds * (1 + len(config.methods) * len(config.counts))
