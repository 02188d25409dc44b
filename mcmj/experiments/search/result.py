"""What a search found: success rates, the ranking of its trials, how far the engines agree."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mcmj.experiments.search.config import Config
from mcmj.metrics.success_rates import success_rate
from mcmj.search.experiment import Score
from mcmj.search.summary import success_by_setting
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Confirmation:
    """A trial run again in MuJoCo.

    Attributes:
        index: of the trial in the screening.
        chosen: "best" or "audit".
        screened, confirmed: scores under both engines.
        agrees: both are successes, or none is.
    """

    index: int
    chosen: str
    screened: float
    confirmed: float
    agrees: bool


@dataclass(frozen=True)
class Result:
    """A finished search.

    Attributes:
        settings: (S,) values by path.
        scores: (S, seeds); infinite where a body blew up.
        parts: (S, seeds) by path, where the score's path has several ends.
        diverged: number of trials that blew up.
        confirmations: of the best and of some others, in MuJoCo; empty without a choice.
        bodies: MJCF of the best, best first; empty for an experiment without bodies.
        evaluated, seconds: trials of the screening run this time, and how long that took.
        workers: trials at once.
        overhead: of the search over the bare evaluations, a fraction; None if not measured.
    """

    config: Config
    settings: list[dict[str, object]]
    scores: Array
    parts: dict[str, Array]
    diverged: int
    confirmations: list[Confirmation]
    bodies: list[str]
    evaluated: int
    seconds: float
    workers: int
    overhead: float | None

    @property
    def good(self) -> np.ndarray:
        """(S, seeds) whether a trial was a success."""
        return self._succeed(self.scores)

    @property
    def ranking(self) -> np.ndarray:
        """Indices of all trials, best first: confirmed ones by their score in MuJoCo."""
        return ranking_of(self.config.target, self.scores.ravel(), self.confirmations)

    @property
    def success(self) -> dict[str, dict[str, object]]:
        """Success rates over all trials: each part of the score, and all of them together."""
        rates = {path: success_rate(self._succeed(x).ravel()) for path, x in self.parts.items()}
        return {**(rates if len(rates) > 1 else {}), "all": success_rate(self.good.ravel())}

    @property
    def by_setting(self) -> dict[str, list[dict[str, object]]]:
        """Success rates against each varied field."""
        return success_by_setting(self.config.space, self.settings, self.good)

    @property
    def agreement(self) -> float | None:
        """Share of the confirmed trials with the same verdict under both engines."""
        verdicts = [one.agrees for one in self.confirmations]
        return float(np.mean(verdicts)) if verdicts else None

    def describe(self, index: int) -> dict[str, object]:
        """A trial: its seed, setting and scores."""
        setting, seed = divmod(index, self.config.seeds)
        confirmed = {c.index: c.confirmed for c in self.confirmations}
        return {
            "seed": self.config.first_seed + seed,
            "setting": self.settings[setting],
            "score": self.scores[setting, seed],
            "confirmed_score": confirmed.get(index),
        }

    def title(self, index: int) -> str:
        """What a trial is called in figures and tables."""
        row = self.describe(index)
        score = row["score"] if row["confirmed_score"] is None else row["confirmed_score"]
        where = setting_label(self.settings[index // self.config.seeds])
        return f"seed {row['seed']}: {short(score)}" + (f" ({where})" if where else "")

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        total = self.success["all"]
        return {
            "score": self.config.target.path,
            "trials": self.scores.size,
            "evaluated": self.evaluated,
            "diverged": self.diverged,
            "success_rate": float(self.good.mean()),
            "successes": total["successes"],
            "interval_95": total["interval_95"],
            "median_score": float(np.median(self.scores)),
            "trials_per_second": self.evaluated / self.seconds if self.evaluated else None,
            "workers": self.workers,
            "overhead_fraction": self.overhead,
            "twin_mujoco_agreement": self.agreement,
            "confirmed": len(self.confirmations),
            "best": self.describe(int(self.ranking[0])),
            "success_by_part": self.success,
            "median_by_part": {path: float(np.median(x)) for path, x in self.parts.items()},
            "success_by_setting": self.by_setting,
        }

    def _succeed(self, scores: Array) -> np.ndarray:
        target = self.config.target
        return scores > target.threshold if target.maximise else scores < target.threshold


def setting_label(setting: dict[str, object]) -> str:
    """A setting in a few words."""
    return ", ".join(f"{path.rpartition('.')[2]} {short(value)}" for path, value in setting.items())


def short(value: object) -> str:
    """Three digits."""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def ranking_of(score: Score, scores: Array, confirmations: Sequence[Confirmation]) -> np.ndarray:
    """Best first: by the confirmed score where there is one, and those before all others."""
    confirmed = {one.index: one.confirmed for one in confirmations if one.chosen == "best"}
    keys = [
        (index not in confirmed, score.order(confirmed.get(index, float(scores[index]))))
        for index in range(len(scores))
    ]
    return np.array(sorted(range(len(scores)), key=keys.__getitem__))
