"""What `design` runs: its Config, and the trials that it asks for."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated

import tyro

from mcmj.experiments.design import measured, one_body, trade_off
from mcmj.search.experiment import Trial
from mcmj.search.space import MAX_TRIALS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_names

PARTS = ("bodies", "smallest", "predictors", "pareto")
DESIGN = "mcmj.experiments.design.one_body"  # the experiments that trials are
MEASURE = "mcmj.experiments.design.measured"
TRADE_OFF = "mcmj.experiments.design.trade_off"


@dataclass(frozen=True)
class Config(one_body.Config):
    """What to design.

    Attributes:
        task: van_der_pol, quadratic, lissajous, a gait, a .csv file, package.module:function; or
            input_driven: three rhythms chosen by an input.
        nodes: number of masses of the part bodies; default: as many as leave random bodies room
            to fail.
        seed: of the first body; its proposals and the noise of its search have the same.
        seeds: number of bodies, of consecutive seeds.
        parts: bodies: one from each random body; smallest: the same for every task of tasks and
            number of nodes of sizes; predictors: which measure of a random body before teaching
            tells whether it will learn; pareto: exact or robust against noise on the lengths, by
            several weights of both.
        tasks: of the part smallest ..
        sizes: .. and its numbers of nodes.
        measured: number of random bodies of the part predictors.
        varied: what may differ from the random body: springs, rest_lengths, positions, masses,
            feedback (mcmj.search.body_space).
        evaluations: at most so many bodies are tried for each.
        spread: standard deviation of the first proposals, in units of body_space.
        aim: a body is taken when its orbit error is below this with every noise of the checks.
        checks: number of noise seeds, not the search's, that a body must pass to be taken.
        threshold: largest orbit error of a success.
        judged: number of noise seeds, not those of search or checks, that it is judged with.
        free_run: from total rest, its last 20 s are judged [s].
        teaching: how the readout is taught; input_driven has its own way.
        tries: number of bodies for each weight of the part pareto.
        sensor_noise: standard deviation of its white noise on all lengths [m].
        workers: processes, one thread each; default: one a core.
        store: file that keeps what is finished; default: trials.sqlite in the output folder.
    """

    seed: Annotated[int, tyro.conf.arg(aliases=["--first-seed"])] = 0
    seeds: int = 10
    parts: tuple[str, ...] = ("bodies",)
    tasks: tuple[str, ...] = ("van_der_pol", "quadratic", "lissajous")
    sizes: tuple[int, ...] = (3, 4, 5, 6, 8, 10)
    measured: int = 1000
    tries: int = 100
    sensor_noise: float = 0.03
    workers: int | None = None
    store: Path | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require_count("seeds", self.seeds, 1)
        require_count("seed", self.seed, 0, one_body.CHECKED_FROM - self.seeds)  # of noise, too
        for name in ("tasks", "sizes"):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise InvalidArgumentError(name, "at least one, each once", values)
        require_names("part", self.parts, PARTS)
        if self.workers is not None:
            require_count("workers", self.workers, 1)
        require_count("measured", self.measured, 10, MAX_TRIALS)
        # these build, so check, the configs of all of them
        self.designs, self.smallest, self.measurements, self.trade_offs  # noqa: B018

    @property
    def designs(self) -> list[Trial]:
        """Of the part bodies: one for each seed."""
        return self._of(self.task, self.settings.nodes) if "bodies" in self.parts else []

    @property
    def smallest(self) -> dict[str, dict[int, list[Trial]]]:
        """Of the part smallest, by task and number of nodes: one for each seed."""
        tasks = self.tasks if "smallest" in self.parts else ()
        return {task: {nodes: self._of(task, nodes) for nodes in self.sizes} for task in tasks}

    @property
    def measurements(self) -> list[Trial]:
        """Of the part predictors."""
        if "predictors" not in self.parts:
            return []
        one = measured.Config(self.task, self.settings.nodes, teaching=self.teaching)
        return [Trial(MEASURE, replace(one, seed=self.seed + k)) for k in range(self.measured)]

    @property
    def trade_offs(self) -> list[Trial]:
        """Of the part pareto."""
        if "pareto" not in self.parts:
            return []
        one = trade_off.Config(
            task=self.task,
            nodes=self.settings.nodes,
            varied=self.varied,
            spread=self.spread,
            tries=self.tries,
            sensor_noise=self.sensor_noise,
            teaching=self.teaching,
        )
        return [Trial(TRADE_OFF, replace(one, seed=self.seed + k)) for k in range(self.seeds)]

    def _of(self, task: str, nodes: int) -> list[Trial]:
        names = [field.name for field in fields(one_body.Config)]
        one = one_body.Config(**{name: getattr(self, name) for name in names})
        return [
            Trial(DESIGN, replace(one, task=task, nodes=nodes, seed=self.seed + k))
            for k in range(self.seeds)
        ]
