"""One random body measured before it is taught, then taught: a trial of the search machinery."""

from dataclasses import dataclass, field

from mcmj.analysis.promise import promise
from mcmj.core.random_body import draw_body
from mcmj.experiments.design.judges import LimitCycle
from mcmj.learning.lessons import Teaching
from mcmj.targets.named import named_target
from mcmj.utils.validation import require_seed


@dataclass(frozen=True)
class Config:
    """What to measure.

    Attributes:
        task: a target's name.
        nodes: number of masses.
        seed: of the random body and of the noise.
        free_run: from total rest [s].
        teaching: how the readout is taught.
    """

    task: str = "van_der_pol"
    nodes: int = 10
    seed: int = 0
    free_run: float = 60.0
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        self.judge.settings(self.nodes)  # checks task and nodes

    @property
    def judge(self) -> LimitCycle:
        """Of the task."""
        return LimitCycle(named_target(self.task), self.teaching, self.free_run)


@dataclass(frozen=True)
class Result:
    """The measures by name, and the orbit error after teaching."""

    measures: dict[str, float]
    orbit_error: float

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types."""
        return {"measures": self.measures, "orbit_error": self.orbit_error}


def run(config: Config) -> Result:
    """Measure, teach, run free.

    Raises:
        DivergenceError: the body blew up before it was taught.
    """
    judge = config.judge
    body = draw_body(config.seed, judge.settings(config.nodes))
    measures = promise(body, judge.target, config.seed)
    return Result(measures, judge.full(body, config.seed).worst)
