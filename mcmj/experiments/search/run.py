"""Search bodies by the thousand: screen with the compiled twin, confirm in MuJoCo."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.experiments.search.config import Config
from mcmj.experiments.search.cost import affordable, overhead
from mcmj.experiments.search.result import Confirmation, Result, ranking_of
from mcmj.search.database import TrialStore
from mcmj.search.experiment import DIVERGED, Outcome, Score, Trial, trained_body
from mcmj.search.overrides import override
from mcmj.search.runner import run_trials
from mcmj.search.workers import Workers, open_workers, results
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

OnTrial = Callable[[float], object]  # gets the score


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
        order = ranking_of(score, scores, checked)[: config.best]
        bodies = _bodies(config, trials, scores, checked, order, workers)
        number = affordable([one.seconds for one in outcomes[: config.cost_trials]])
        cost = overhead(trials[:number], workers) if number else None
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
    order = ranking_of(score, scores, [])
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
            "score": config.target.path,
            "screened": float(scores[index]),
            "confirmed": confirmed.get(index),
        }
        tasks.append((in_mujoco(trials[index]), account))
    return [xml for xml in results(workers, trained_body, tasks) if xml is not None]
