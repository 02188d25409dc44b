"""Bodies designed for a task, each a trial of the search machinery: parallel, kept, resumed."""

from collections.abc import Callable
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.experiments.design.config import DESIGN, TRADE_OFF, Config
from mcmj.experiments.design.fronts import Fronts
from mcmj.experiments.design.predictors import Predictors
from mcmj.experiments.design.result import Designs, Result
from mcmj.search.database import TrialStore
from mcmj.search.experiment import Outcome, Trial
from mcmj.search.runner import run_trials
from mcmj.search.workers import open_workers

OnBody = Callable[[float], object]  # gets its orbit error


def total_bodies(config: Config) -> int:
    """Different ones, for a progress bar."""
    return len({trial.key for trial in _all(config)})


def _all(config: Config) -> list[Trial]:
    sizes = chain.from_iterable(sizes.values() for sizes in config.smallest.values())
    designs = [*config.designs, *chain.from_iterable(sizes)]
    return [*designs, *config.measurements, *config.trade_offs]


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
        done = run_trials(_all(config), kept, workers, on_outcome=partial(_tell, on_body)).outcomes

    def of(trials: list[Trial]) -> list[dict[str, Any]]:
        return [done[trial.key].metrics for trial in trials]

    smallest = {
        task: {nodes: Designs(of(trials), config.threshold) for nodes, trials in sizes.items()}
        for task, sizes in config.smallest.items()
    }
    known = [one for one in of(config.measurements) if one]  # a body that blew up has none
    return Result(
        config,
        Designs(of(config.designs), config.threshold) if config.designs else None,
        smallest,
        Predictors(known, config.threshold) if known else None,
        Fronts(of(config.trade_offs), config.threshold) if config.trade_offs else None,
    )


def _tell(on_body: OnBody, trial: Trial, outcome: Outcome) -> None:
    metrics = outcome.metrics
    if trial.experiment == DESIGN:
        errors = metrics["designed"]["orbit_errors"]
    elif trial.experiment == TRADE_OFF:
        errors = metrics["designed"][0][:1]  # the most exact of the front
    else:
        errors = [metrics.get("orbit_error")]
    on_body(max(np.inf if error is None else error for error in errors))
