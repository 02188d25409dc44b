"""Search bodies by the thousand: screen with the compiled twin, confirm in MuJoCo."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.errors import InvalidArgumentError
from mcmj.experiments.search_cost import overhead
from mcmj.rates import success_rate
from mcmj.search.database import TrialStore
from mcmj.search.experiment import DIVERGED, Outcome, Score, Trial, make_config, trained_body
from mcmj.search.overrides import override, parse_assignment
from mcmj.search.runner import run_trials
from mcmj.search.space import Space, expand, parse_dimension
from mcmj.search.summary import success_by_setting
from mcmj.search.workers import Workers, open_workers, results
from mcmj.streams import stream
from mcmj.validation import Array, require_count, require_number

OnTrial = Callable[[float], object]  # gets the score


@dataclass(frozen=True)
class Config:
    """What to search. Settings are combined with each other, and each with every seed.

    Attributes:
        experiment: limit_cycle, perturb, swing_up, .. or the full name of a module of your own.
        set: values of its config for all trials, as in teaching.noise=0.1 task=quadratic.
        vary: fields to vary, as in teaching.noise=[0.1,0.2] settings.nodes=int(15,40)
            teaching.ridge_per_row=log(1e-9,1e-3), or a grid of 7 values: =log(1e-9,1e-3,7).
        draws: random settings, if there are ranges.
        seeds: number of bodies of each setting.
        first_seed: their seeds are consecutive from here.
        score: dotted path into the metrics; "*" stands for every key, and the worst counts.
        threshold: a success is below it.
        maximise: large scores are good, and a success is above the threshold.
        engine: that screens, if the experiment has a choice: twin or mujoco.
        confirm: number of the best trials that are run again in MuJoCo.
        audit: number of trials, drawn from all others, that are too, to see how often the
            engines disagree.
        best: number of bodies written and drawn.
        draw_seed: of random settings and of the audit.
        cost_trials: number of trials run again to measure what searching costs on top.
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
    score: str = "*.orbit_error"
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
        for name in ("seeds", "draws", "best"):
            require_count(name, getattr(self, name), 1)
        for name in ("first_seed", "draw_seed", "confirm", "audit", "cost_trials"):
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
    def fixed(self) -> dict[str, object]:
        """Values for all trials, by path."""
        return dict(parse_assignment(text) for text in self.set)

    @property
    def space(self) -> Space:
        """What is varied, by path."""
        return dict(parse_dimension(text) for text in self.vary)

    @property
    def settings(self) -> list[dict[str, object]]:
        """All settings, values by path."""
        return expand(self.space, self.draws, self.draw_seed)

    @property
    def target(self) -> Score:
        """What the search is after."""
        return Score(self.score, self.threshold, self.maximise)

    @property
    def trials(self) -> list[Trial]:
        """All trials of the screening: every setting with every seed, seeds innermost."""
        found = []
        for setting in self.settings:
            one = make_config(self.experiment, {**self.fixed, **setting})
            if hasattr(one, "engine") and "engine" not in self.fixed:
                one = override(one, {"engine": self.engine})
            found += [
                Trial(self.experiment, override(one, {"seed": self.first_seed + k}))
                for k in range(self.seeds)
            ]
        return found


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
        return _ranking(self.config.target, self.scores.ravel(), self.confirmations)

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

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        total = self.success["all"]
        return {
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


def total_trials(config: Config) -> int:
    """Of both stages, for a progress bar."""
    return len(config.trials) + min(len(config.trials), config.confirm + config.audit)


def run(
    config: Config, *, store: Path = Path("trials.sqlite"), on_trial: OnTrial = lambda score: None
) -> Result:
    """Screen all trials, confirm the best in MuJoCo, and fetch the best bodies.

    Args:
        store: file of the trials, if the config names none.
        on_trial: called with the score of every trial.

    Raises:
        McmjError: a trial that cannot run, or a store, cluster or disk that does not work. What
            is finished is kept; the same call goes on from there.
    """
    trials, score = config.trials, config.target

    def tell(trial: Trial, outcome: Outcome) -> None:
        on_trial(score.of(outcome))

    with (
        open_workers(config.workers, config.scheduler) as workers,
        TrialStore(config.store or store) as kept,
    ):
        screened = run_trials(trials, kept, workers, on_outcome=tell)
        outcomes = [screened.outcomes[trial.key] for trial in trials]
        scores = np.array([score.of(outcome) for outcome in outcomes])
        checked = _confirm(config, trials, scores, kept, workers, tell)
        order = _ranking(score, scores, checked)[: config.best]
        bodies = _bodies(config, trials, scores, checked, order, workers)
        cost = overhead(trials[: config.cost_trials], workers) if config.cost_trials else None
        shape = (len(config.settings), config.seeds)
        return Result(
            config=config,
            settings=config.settings,
            scores=scores.reshape(shape),
            parts=_parts(score, outcomes, shape),
            diverged=sum(outcome.status == DIVERGED for outcome in outcomes),
            confirmations=checked,
            bodies=bodies,
            evaluated=screened.evaluated,
            seconds=screened.seconds,
            workers=workers.count,
            overhead=cost,
        )


def _parts(score: Score, outcomes: Sequence[Outcome], shape: tuple[int, int]) -> dict[str, Array]:
    """Scores at each end of the path; the worst where a trial blew up."""
    found = [score.parts(outcome) for outcome in outcomes]
    names = dict.fromkeys(name for parts in found for name in parts)
    return {
        name: np.array([parts.get(name, score.worst) for parts in found]).reshape(shape)
        for name in names
    }


def _confirm(
    config: Config,
    trials: Sequence[Trial],
    scores: Array,
    store: TrialStore,
    workers: Workers,
    tell: Callable[[Trial, Outcome], None],
) -> list[Confirmation]:
    """The best trials, and some of the others, in MuJoCo."""
    if getattr(trials[0].config, "engine", "mujoco") == "mujoco":
        return []
    score = config.target
    order = _ranking(score, scores, [])
    best, others = order[: config.confirm], order[config.confirm :]
    audited = stream(config.draw_seed, "search_audit").permutation(others)[: config.audit]
    chosen = dict.fromkeys(best.tolist(), "best") | dict.fromkeys(audited.tolist(), "audit")
    again = {index: in_mujoco(trials[index]) for index in chosen}
    run = run_trials(list(again.values()), store, workers, on_outcome=tell)
    found = []
    for index, why in chosen.items():
        confirmed, screened = score.of(run.outcomes[again[index].key]), float(scores[index])
        agrees = score.succeeds(confirmed) == score.succeeds(screened)
        found.append(Confirmation(index, why, screened, confirmed, agrees))
    return found


def in_mujoco(trial: Trial) -> Trial:
    """The same trial with MuJoCo as its engine, if it has a choice."""
    if not hasattr(trial.config, "engine"):
        return trial
    return dataclasses.replace(trial, config=override(trial.config, {"engine": "mujoco"}))


def _ranking(score: Score, scores: Array, confirmations: Sequence[Confirmation]) -> np.ndarray:
    """Best first: by the confirmed score where there is one, and those before all others."""
    confirmed = {one.index: one.confirmed for one in confirmations if one.chosen == "best"}
    keys = [
        (index not in confirmed, score.order(confirmed.get(index, float(scores[index]))))
        for index in range(len(scores))
    ]
    return np.array(sorted(range(len(scores)), key=keys.__getitem__))


def _bodies(
    config: Config,
    trials: Sequence[Trial],
    scores: Array,
    confirmations: Sequence[Confirmation],
    order: np.ndarray,
    workers: Workers,
) -> list[str]:
    """MJCF of the best that are successes at all, with scores and where they come from."""
    confirmed = {one.index: one.confirmed for one in confirmations}
    tasks = []
    for index in order:
        if not np.isfinite(scores[index]) or not np.isfinite(confirmed.get(index, 0.0)):
            continue
        account: Mapping[str, Any] = {
            "searched": len(trials),
            "score": config.score,
            "screened": float(scores[index]),
            "confirmed": confirmed.get(index),
        }
        tasks.append((in_mujoco(trials[index]), account))
    return [xml for xml in results(workers, trained_body, tasks) if xml is not None]
