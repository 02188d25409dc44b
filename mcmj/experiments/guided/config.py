"""What a guided search tries: its Config, and the objectives."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mcmj.experiments.search.config import Searched
from mcmj.search.experiment import Score, make_config
from mcmj.search.overrides import override, value_at
from mcmj.search.space import MAX_SEED, MAX_TRIALS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_count, require_name, require_number

WORST_LOG = 1.0  # log10 of the score that counts for everything worse, blow-ups too


def _mean_log(scores: Array, score: Score) -> float:
    if score.maximise or (scores <= 0).any():
        raise InvalidArgumentError("objective", "success_rate or median for such scores", "log")
    return float(np.minimum(np.log10(scores), WORST_LOG).mean())


OBJECTIVES: dict[str, Callable[[Array, Score], float]] = {
    "log": _mean_log,
    "success_rate": lambda scores, score: float(np.mean([score.succeeds(x) for x in scores])),
    "median": lambda scores, score: float(np.clip(np.median(scores), -1e9, 1e9)),
}


@dataclass(frozen=True)
class Config(Searched):
    """What to search.

    Attributes:
        experiment: limit_cycle, perturb, swing_up, .. or the full name of a module of your own.
        set: values of its config for all trials, as in task=quadratic.
        vary: fields to choose, as in teaching.noise=log(0.01,1) settings.nodes=int(15,40)
            task=["quadratic","lissajous"].
        settings: number of settings to try.
        startup: of them that are random; the hand-chosen setting comes first of all.
        bodies: of each setting, the same seeds for all.
        first_seed: of these bodies.
        judged: number of other bodies on which the best setting meets the hand-chosen one.
        judged_from: their first seed.
        confirm: so many of them are run again in MuJoCo with the best setting; default: all.
        score, threshold, maximise: of a trial, as for a search.
        objective: of a setting, over its bodies: log (mean of log10 of the scores, at most 1
            each), success_rate or median.
        engine: that runs the trials, if the experiment has a choice: twin or mujoco.
        draw_seed: of the proposals.
        workers: processes, one thread each; default: one a core.
        scheduler: address of a Dask scheduler; then its workers run the trials.
        store: file that keeps all trials; default: trials.sqlite in the output folder.
        study: file that keeps Optuna's study; default: study.sqlite in the output folder.
    """

    experiment: str = "limit_cycle"
    set: tuple[str, ...] = ("task=quadratic", "free_run=60")
    vary: tuple[str, ...] = ("teaching.noise=log(0.01,1)", "teaching.ridge_per_row=log(1e-12,1e-4)")
    settings: int = 40
    startup: int = 10
    bodies: int = 8
    first_seed: int = 0
    judged: int = 50
    judged_from: int = 1000
    confirm: int | None = None
    score: str | None = None
    threshold: float = 0.05
    maximise: bool = False
    objective: str = "log"
    engine: str = "twin"
    draw_seed: int = 0
    workers: int | None = None
    scheduler: str | None = None
    store: Path | None = None
    study: Path | None = None

    def __post_init__(self) -> None:
        for name in ("settings", "bodies", "judged"):
            require_count(name, getattr(self, name), 1, MAX_TRIALS)
        require_count("settings x bodies", self.settings * self.bodies, 1, MAX_TRIALS)
        for name in ("startup", "first_seed", "judged_from", "draw_seed"):
            require_count(name, getattr(self, name), 0, MAX_SEED - MAX_TRIALS)
        if self.confirm is not None:
            require_count("confirm", self.confirm, 0)
        require_number("threshold", self.threshold, -np.inf)
        require_name("objective", OBJECTIVES, self.objective)
        seen = range(self.first_seed, self.first_seed + self.bodies)
        if max(seen[0], self.judged_from) <= min(seen[-1], self._judged_seeds[-1]):
            raise InvalidArgumentError("judged_from", "seeds that the search does not use", seen)
        for path in self.space:
            value_at(self.hand_chosen, path)

    @property
    def hand_chosen(self) -> object:
        """The experiment's config without a search."""
        one = make_config(self.experiment, self.fixed)
        return override(one, {"engine": self.engine}) if hasattr(one, "engine") else one

    @property
    def large_is_good(self) -> bool:
        """Of the objective."""
        return self.maximise or self.objective == "success_rate"

    @property
    def _judged_seeds(self) -> range:
        return range(self.judged_from, self.judged_from + self.judged)
