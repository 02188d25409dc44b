"""One body designed: a trial of the search machinery, see mcmj.search.experiment."""

import time
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings, draw_body
from mcmj.experiments.design.judges import NODES, USUAL_NODES, Judge, Tried, judge_of
from mcmj.learning.lessons import Teaching
from mcmj.mjcf.write import to_mjcf
from mcmj.search.body_space import VARIED, BodySpace
from mcmj.search.evolution import Evolution
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.files import plain, versions
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_names,
    require_number,
    require_seed,
)

BOUND = 2.0  # of every parameter: springs within exp(-2) to exp(2) times those drawn
CHECKED_FROM, JUDGED_FROM = 10**6, 2 * 10**6  # noise seeds that the search does not use itself


@dataclass(frozen=True)
class Config:
    """What to design.

    Attributes:
        task: a target's name, or input_driven.
        nodes: number of masses; default: as many as leave random bodies room to fail.
        seed: of the random body to begin with, of the proposals and of the noise in the search.
        varied: what may differ from the random body, see mcmj.search.body_space.
        evaluations: at most so many bodies are tried.
        spread: standard deviation of the first proposals, in units of body_space.
        aim: a body is taken when its orbit error is below this with every noise of the checks.
        checks: number of noise seeds, not the search's, that a body must pass to be taken.
        threshold: largest orbit error of a success.
        judged: number of noise seeds, not those of search or checks, that it is judged with.
        free_run: from total rest, its last 20 s are judged [s].
        teaching: how the readout is taught; input_driven has its own way.
    """

    task: str = "van_der_pol"
    nodes: int | None = None
    seed: int = 0
    varied: tuple[str, ...] = ("springs", "feedback")
    evaluations: int = 400
    spread: float = 0.5
    aim: float = 0.02
    checks: int = 12
    threshold: float = 0.05
    judged: int = 3
    free_run: float = 300.0
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        require_names("varied", self.varied, VARIED)
        for name in ("evaluations", "checks", "judged"):
            require_count(name, getattr(self, name), 1)
        for name in ("spread", "aim", "threshold"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        if self.aim > self.threshold:
            raise InvalidArgumentError("aim", f"at most the threshold {self.threshold}", self.aim)
        require_duration("free_run", self.free_run)
        self.settings  # noqa: B018  checks task and nodes

    @property
    def judge(self) -> Judge:
        """Of the task."""
        return judge_of(self.task, self.teaching, self.free_run)

    @property
    def settings(self) -> BodySettings:
        """What random bodies are drawn from."""
        nodes = NODES.get(self.task, USUAL_NODES) if self.nodes is None else self.nodes
        return self.judge.settings(nodes)

    @cached_property
    def drawn(self) -> Body:
        """The random body to begin with."""
        return draw_body(self.seed, self.settings)


class Hunt:
    """Bodies tried one after the other, until one passes the checks.

    Attributes:
        tried: number of bodies so far.
        best: the body that passed, or else the best so far.
        x: where it is in the space of the design.
        passed: whether it did.
        scores: of all of them, see Tried.score.
    """

    def __init__(self, config: Config) -> None:
        self._config, self._judge = config, config.judge
        self.tried, self.passed = 0, False
        self.best: Body = config.drawn
        self.x: Array | None = None
        self.scores: list[float] = []
        self._rank = (np.inf, np.inf)

    @property
    def over(self) -> bool:
        """A body passed, or there were as many as may be."""
        return self.passed or self.tried >= self._config.evaluations

    def attempt_at(self, space: BodySpace, x: Array) -> float:
        """Try the body at x, if there is such a body; its score."""
        try:
            body = space.body(x)
        except InvalidArgumentError:
            self.tried += 1
            return np.inf
        return self.attempt(body, x)

    def attempt(self, body: Body, x: Array | None = None) -> float:
        """Try a body, which is at x; its score."""
        self.tried += 1
        first = self._judge.quick(body, self._config.seed)
        self.scores.append(first.score)
        checked = np.inf
        if first.worst < self._config.aim:
            checked = _worst(self._config, body, CHECKED_FROM, self._config.checks)
        if (rank := (checked, first.score)) < self._rank:
            self.best, self.x, self._rank = body, x, rank
        self.passed = checked < self._config.aim
        return first.score


def _worst(config: Config, body: Body, first: int, count: int) -> float:
    """Largest error over noise seeds, none after one above the aim."""
    worst = 0.0
    for seed in range(first, first + count):
        worst = max(worst, config.judge.full(body, seed).worst)
        if worst >= config.aim:
            break
    return worst


def evolve(config: Config) -> Hunt:
    """From the drawn body on, by CMA-ES."""
    hunt, space = Hunt(config), BodySpace(config.drawn, config.varied)
    hunt.attempt(config.drawn, np.zeros(space.size))
    evolution = Evolution(space.size, config.seed, spread=config.spread, bound=BOUND)
    while not hunt.over:
        candidates, scores = evolution.ask(), []
        for x in candidates:
            scores.append(hunt.attempt_at(space, x))
            if hunt.over:
                return hunt
        evolution.tell(candidates, scores)
    return hunt


def search(config: Config) -> Hunt:
    """Bodies at random instead, the drawn one the first: as many as a design may try."""
    hunt = Hunt(config)
    hunt.attempt(config.drawn)
    numbers = stream(config.seed, "random_search")
    while not hunt.over:
        hunt.attempt(draw_body(int(numbers.integers(2**31)), config.settings))
    return hunt


@dataclass(frozen=True)
class Verdict:
    """What a body is worth, under noise that no search has seen.

    Attributes:
        errors: the worst orbit error with each noise seed, up to the first that is too large.
        readout: of the first of them.
    """

    errors: list[float]
    readout: Array | None
    threshold: float

    @property
    def success(self) -> bool:
        """Below the threshold with every noise."""
        return max(self.errors) < self.threshold

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types."""
        return {"success": self.success, "orbit_errors": self.errors}


def judged(config: Config, body: Body) -> Verdict:
    """A body on trial."""
    found: list[Tried] = []
    for seed in range(JUDGED_FROM, JUDGED_FROM + config.judged):
        found.append(config.judge.full(body, seed))
        if found[-1].worst >= config.threshold:
            break
    return Verdict([one.worst for one in found], found[0].w_out, config.threshold)


@dataclass(frozen=True)
class Result:
    """A body designed, beside the drawn one and one found at random.

    Attributes:
        body: the designed one.
        hunt, found: the design; the search at random, with as many bodies at most.
        verdicts: of the bodies "random", "designed" and "search".
        mujoco: the designed one in MuJoCo, with the first of the noises.
        exact: orbit error of its readout under DOP853, of a success; None: not known.
        seconds: that the design took.
    """

    config: Config
    body: Body
    hunt: Hunt
    found: Hunt
    verdicts: dict[str, Verdict]
    mujoco: Tried
    exact: float | None
    seconds: float

    @property
    def readouts(self) -> dict[str, Array]:
        """The designed body's, by task."""
        readout = self.verdicts["designed"].readout
        return {} if readout is None else {self.config.task: readout}

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types."""
        twin = self.verdicts["designed"].errors[0]
        return {
            **{name: verdict.metrics for name, verdict in self.verdicts.items()},
            "passed": self.hunt.passed,
            "search_passed": self.found.passed,
            "evaluations": self.hunt.tried,
            "search_evaluations": self.found.tried,
            "parameters": BodySpace(self.config.drawn, self.config.varied).size,
            "springs": self.body.n_springs,
            "scores": self.hunt.scores,
            "mujoco_error": self.mujoco.worst,
            "mujoco_agrees": (self.mujoco.worst < self.config.threshold)
            == (twin < self.config.threshold),
            "dop853_error": self.exact,
            "seconds": self.seconds,
            "xml": self.xml,
        }

    @property
    def xml(self) -> str:
        """The designed body with its readout, and how it came about."""
        account = {
            "experiment": "design",
            "body": {"seed": self.config.seed, "settings": plain(self.config.settings)},
            "varied": self.config.varied,
            "x": plain(self.hunt.x),
            "config": plain(self.config),
            "bodies_tried": self.hunt.tried,
            "orbit_errors": self.verdicts["designed"].errors,
            "versions": versions(),
        }
        readout = self.verdicts["designed"].readout
        return to_mjcf(self.body, w_out=readout, readouts=self.readouts, provenance=account)


def run(config: Config) -> Result:
    """Design a body, look for one at random, and judge both and the drawn one."""
    begin = time.perf_counter()
    hunt = evolve(config)
    seconds = time.perf_counter() - begin
    found = search(config)
    bodies = {"random": config.drawn, "designed": hunt.best, "search": found.best}
    known: dict[int, Verdict] = {}  # by body: all three may be the drawn one
    for body in bodies.values():
        if id(body) not in known:
            known[id(body)] = judged(config, body)
    verdicts = {name: known[id(body)] for name, body in bodies.items()}
    designed = verdicts["designed"]
    exact = None
    if designed.success and designed.readout is not None:
        exact = config.judge.exact(hunt.best, designed.readout)
    mujoco = config.judge.full(hunt.best, JUDGED_FROM, engine="mujoco")
    return Result(config, hunt.best, hunt, found, verdicts, mujoco, exact, seconds)
