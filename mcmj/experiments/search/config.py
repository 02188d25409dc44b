"""What a search runs: its Config, and the trials that it asks for."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mcmj.search.experiment import Score, Trial, default_score, make_config
from mcmj.search.overrides import override, parse_assignment
from mcmj.search.space import MAX_SEED, MAX_TRIALS, Space, expand, parse_dimension
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_number


class Searched:
    """What the configs of searches have in common: an experiment, and the score of its trials."""

    experiment: str
    set: tuple[str, ...]
    vary: tuple[str, ...]
    score: str | None
    threshold: float
    maximise: bool

    @property
    def fixed(self) -> dict[str, object]:
        """Values for all trials, by path."""
        return dict(parse_assignment(text) for text in self.set)

    @property
    def space(self) -> Space:
        """What is varied, by path."""
        return dict(parse_dimension(text) for text in self.vary)

    @property
    def target(self) -> Score:
        """What the search is after."""
        path = self.score or default_score(self.experiment)
        return Score(path, self.threshold, self.maximise)


@dataclass(frozen=True)
class Config(Searched):
    """What to search. Settings are combined with each other, and each with every seed.

    Attributes:
        experiment: limit_cycle, perturb, swing_up, .. or the full name of a module of your own.
        set: values of its config for all trials, as in noise=0.1 task=quadratic.
        vary: fields to vary, as in teaching.noise=[0.1,0.2] settings.nodes=int(15,40)
            teaching.ridge_per_row=log(1e-9,1e-3), or a grid of 7 values: =log(1e-9,1e-3,7).
        draws: random settings, if there are ranges.
        seeds: number of bodies of each setting.
        first_seed: their seeds are consecutive from here.
        score: path into the metrics, as in quadratic/orbit_error; "*" stands for every key, and
            the worst counts; default: what the experiment asks for.
        threshold: a success is below it.
        maximise: large scores are good, and a success is above the threshold.
        engine: that screens, if the experiment has a choice: twin or mujoco.
        confirm: number of the best trials that are run again in MuJoCo.
        audit: number of trials, drawn from all others, that are too, to see how often the
            engines disagree.
        best: number of bodies written and drawn.
        draw_seed: of random settings and of the audit.
        cost_trials: number of trials run again to measure what searching costs on top; fewer,
            or none, where that would take over a minute.
        workers: processes, one thread each; default: one a core.
        scheduler: address of a Dask scheduler; then its workers run the trials.
        store: file that keeps all trials; default: trials.sqlite in the output folder.
    """

    experiment: str = "limit_cycle"
    set: tuple[str, ...] = ()
    vary: tuple[str, ...] = ()
    draws: int = 20
    seeds: int = 50
    first_seed: int = 0
    score: str | None = None
    threshold: float = 0.05
    maximise: bool = False
    engine: str = "twin"
    confirm: int = 10
    audit: int = 10
    best: int = 3
    draw_seed: int = 0
    cost_trials: int = 24
    workers: int | None = None
    scheduler: str | None = None
    store: Path | None = None

    def __post_init__(self) -> None:
        require_count("draws", self.draws, 1, MAX_TRIALS)
        require_count("seeds", self.seeds, 1, MAX_TRIALS)
        require_count("first_seed", self.first_seed, 0, MAX_SEED - self.seeds)
        for name in ("draw_seed", "confirm", "audit", "best", "cost_trials"):
            require_count(name, getattr(self, name), 0)
        require_number("threshold", self.threshold, -np.inf)
        if self.workers is not None:
            require_count("workers", self.workers, 1)
        if self.workers is not None and self.scheduler is not None:
            raise InvalidArgumentError("workers", "none beside a scheduler", self.workers)
        fixed, varied = set(self.fixed), set(self.space)
        if twice := fixed & varied | (fixed | varied) & {"seed"}:
            raise InvalidArgumentError("set, vary", "each field once, seed excepted", min(twice))
        self.trials  # noqa: B018  # builds, so checks, the configs of all trials

    @property
    def settings(self) -> list[dict[str, object]]:
        """All settings, values by path."""
        return expand(self.space, self.draws, self.draw_seed)

    @property
    def trials(self) -> list[Trial]:
        """All trials of the screening: every setting with every seed, seeds innermost."""
        found, settings = [], self.settings
        if (total := len(settings) * self.seeds) > MAX_TRIALS:
            raise InvalidArgumentError("seeds, vary", f"at most {MAX_TRIALS} trials", total)
        for setting in settings:
            one = make_config(self.experiment, {**self.fixed, **setting})
            if hasattr(one, "engine") and "engine" not in self.fixed:
                one = override(one, {"engine": self.engine})
            found += [
                Trial(self.experiment, override(one, {"seed": self.first_seed + k}))
                for k in range(self.seeds)
            ]
        return found
