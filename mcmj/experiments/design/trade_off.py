"""Exact or robust: one body designed for several mixtures of both, a trial of the search machinery.

Every body is taught once and started twice from total rest, without noise and with white noise on
all lengths. A weight w asks for the smallest (1 - w) log e + w log e', e and e' the two orbit
errors; what no other body beats in both is the front.
"""

from dataclasses import dataclass, field

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import draw_body
from mcmj.experiments.design.judges import LimitCycle, Tried
from mcmj.experiments.design.one_body import BOUND
from mcmj.learning.lessons import Teaching
from mcmj.search.body_space import VARIED, BodySpace
from mcmj.search.evolution import Evolution
from mcmj.targets.named import named_target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_names,
    require_number,
    require_seed,
)

WEIGHTS = (0.0, 0.5, 1.0)
LOST = 10.0  # an orbit error that stands for all that are larger


@dataclass(frozen=True)
class Config:
    """What to design.

    Attributes:
        task: a target's name.
        nodes: number of masses.
        seed: of the random body to begin with, of the proposals and of the noise.
        varied, spread: as for a design.
        tries: number of bodies for each weight.
        sensor_noise: standard deviation of the white noise on the lengths [m].
        free_run: from total rest, its last 20 s are judged [s].
        teaching: how the readout is taught.
    """

    task: str = "van_der_pol"
    nodes: int = 10
    seed: int = 0
    varied: tuple[str, ...] = ("springs", "feedback")
    spread: float = 0.5
    tries: int = 100
    sensor_noise: float = 0.03
    free_run: float = 60.0
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        require_names("varied", self.varied, VARIED)
        require_count("tries", self.tries, 1)
        for name in ("spread", "sensor_noise"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        self.judge.settings(self.nodes)  # checks task and nodes

    @property
    def judge(self) -> LimitCycle:
        """Of the task."""
        return LimitCycle(named_target(self.task), self.teaching, self.free_run)


@dataclass(frozen=True)
class Result:
    """Errors (n, 2) without and with noise, of all bodies tried, designed and at random."""

    designed: Array
    random: Array

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types: the fronts, and the drawn body."""
        return {
            "tried": len(self.designed),
            "drawn": self.designed[0].tolist(),
            "designed": front(self.designed).tolist(),
            "random": front(self.random).tolist(),
        }


def run(config: Config) -> Result:
    """Design for every weight; then as many bodies at random."""
    settings = config.judge.settings(config.nodes)
    drawn = draw_body(config.seed, settings)
    designed = [_errors(config, drawn)]
    for number, weight in enumerate(WEIGHTS):
        designed += _evolve(config, drawn, weight, number)
    seeds = stream(config.seed, "random_search").integers(2**31, size=len(designed) - 1)
    others = [_errors(config, draw_body(int(seed), settings)) for seed in seeds]
    return Result(np.array(designed), np.array([designed[0], *others]))


def _errors(config: Config, body: Body) -> Array:
    tried: Tried = config.judge.noisy(body, config.seed, config.sensor_noise)
    return np.minimum(tried.errors, LOST)


def _evolve(config: Config, drawn: Body, weight: float, number: int) -> list[Array]:
    """Errors of all bodies tried on the way to the smallest weighted one."""
    space = BodySpace(drawn, config.varied)
    found: list[Array] = []
    seed = config.seed * len(WEIGHTS) + number  # other proposals for every weight and body
    evolution = Evolution(space.size, seed, spread=config.spread, bound=BOUND)
    while len(found) < config.tries:
        candidates, scores = evolution.ask(), []
        for x in candidates:
            try:
                body = space.body(x)
            except InvalidArgumentError:
                errors = np.full(2, LOST)
            else:
                errors = _errors(config, body)
            found.append(errors)
            scores.append(float(np.log(errors) @ [1.0 - weight, weight]))
        evolution.tell(candidates, scores)
    return found


def front(points: Array) -> Array:
    """Those of points (n, 2) that no other is below in both, in order of the first.

    Of points that are the same, one is kept.
    """
    kept: list[Array] = []
    for point in points[np.lexsort(points.T[::-1])]:
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return np.array(kept)
