"""Bodies designed for a task, each a trial of the search machinery: parallel, kept, resumed."""

from collections.abc import Callable
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from mcmj.experiments.design.config import Config
from mcmj.experiments.design.predictors import Predictors
from mcmj.experiments.design.result import Designs, Result
from mcmj.search.database import TrialStore
from mcmj.search.experiment import Outcome, Trial
from mcmj.search.runner import run_trials
from mcmj.search.workers import open_workers

OnBody = Callable[[float], object]  # gets its orbit error


def total_bodies(config: Config) -> int:
    """Different ones, for a progress bar."""
    return len({trial.key for trial in [*_designs(config), *config.measurements]})


def _designs(config: Config) -> list[Trial]:
    return list(chain.from_iterable(t for sizes in config.trials.values() for t in sizes.values()))


def run(
    config: Config,
    *,
    store: Path = Path("trials.sqlite"),
    on_body: OnBody = lambda error: None,
) -> Result:
    """Design and measure all bodies that the parts ask for; those in the store are there already.

    Args:
        store: file of the bodies, if the config names none.
        on_body: called with the worst orbit error of every body.

    Raises:
        McmjError: a file that does not work. What is finished is kept.
    """
    with (
        open_workers(config.workers, None) as workers,
        TrialStore(config.store or store) as kept,
    ):
        tell = partial(_tell, on_body)
        done = run_trials(_designs(config), kept, workers, on_outcome=tell).outcomes
        seen = run_trials(config.measurements, kept, workers, on_outcome=tell).outcomes
    designs = {
        part: {
            nodes: Designs([done[trial.key].metrics for trial in trials], config.threshold)
            for nodes, trials in sizes.items()
        }
        for part, sizes in config.trials.items()
    }
    bodies = [seen[trial.key].metrics for trial in config.measurements]
    predictors = Predictors([one for one in bodies if one], config.threshold) if bodies else None
    return Result(config, designs, predictors)


def _tell(on_body: OnBody, trial: Trial, outcome: Outcome) -> None:
    metrics = outcome.metrics
    errors = metrics["designed"]["orbit_errors"] if "designed" in metrics else []
    errors = errors or [metrics.get("orbit_error")]
    on_body(max(np.inf if error is None else error for error in errors))
