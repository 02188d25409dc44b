"""Guided search for settings (Optuna), judged on bodies that the search has not seen."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from mcmj.experiments.guided.config import OBJECTIVES, Config
from mcmj.experiments.guided.result import Result
from mcmj.search.database import TrialStore
from mcmj.search.experiment import Trial
from mcmj.search.overrides import override, value_at
from mcmj.search.runner import run_trials
from mcmj.search.study import Study
from mcmj.search.workers import Workers, open_workers
from mcmj.utils.files import plain
from mcmj.utils.validation import Array

OnSetting = Callable[[float], object]  # gets the objective


def run(
    config: Config,
    *,
    folder: Path = Path("."),
    on_setting: OnSetting = lambda objective: None,
) -> Result:
    """Try settings, each on the same bodies; then the best against the hand-chosen, on others.

    Args:
        folder: of the trials and the study, where the config names no files.
        on_setting: called with the objective of every setting.

    Raises:
        McmjError: a trial that cannot run, or a file or cluster that does not work. What is
            finished is kept; the same call goes on from there.
    """
    hand = config.hand_chosen
    account = plain([config.experiment, hand, sorted(config.vary), config.target.path,
                     config.objective, config.bodies, config.first_seed, config.draw_seed,
                     config.startup, config.maximise])  # fmt: skip
    study = Study(
        config.study or folder / "study.sqlite", account, config.space, config.draw_seed,
        startup=config.startup, maximise=config.large_is_good,
    )  # fmt: skip
    study.first({path: value_at(hand, path) for path in config.space})
    with (
        open_workers(config.workers, config.scheduler) as workers,
        TrialStore(config.store or folder / "trials.sqlite") as store,
    ):
        bodies = range(config.first_seed, config.first_seed + config.bodies)

        def evaluate(setting: dict[str, object]) -> float:
            scores = _scores(config, setting, bodies, store, workers)
            return OBJECTIVES[config.objective](scores, config.target)

        for _, objective in study.told[: config.settings]:
            on_setting(objective)
        while len(study.told) < config.settings:
            on_setting(study.advance(evaluate))
        best, _ = study.best
        others = config._judged_seeds
        judged = {
            "hand-chosen": _scores(config, {}, others, store, workers),
            "guided": _scores(config, best, others, store, workers),
        }
        choice = getattr(hand, "engine", "mujoco") != "mujoco"
        in_mujoco, some = best | {"engine": "mujoco"}, others[: config.confirm]
        confirmed = _scores(config, in_mujoco, some, store, workers) if choice else np.zeros(0)
    return Result(config, study.told, best, judged, confirmed)


def _scores(
    config: Config, setting: dict[str, object], seeds: range, store: TrialStore, workers: Workers
) -> Array:
    one = override(config.hand_chosen, setting)
    trials = [Trial(config.experiment, override(one, {"seed": seed})) for seed in seeds]
    outcomes = run_trials(trials, store, workers).outcomes
    return np.array([config.target.of(outcomes[trial.key]) for trial in trials])
