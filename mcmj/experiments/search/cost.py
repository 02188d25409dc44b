"""What a search costs on top of the bare evaluations, side by side on the same workers."""

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mcmj.search.database import TrialStore
from mcmj.search.experiment import Trial, load_experiment
from mcmj.search.runner import run_trials
from mcmj.search.workers import Workers, results

REPEATS = 3
BUDGET = 60.0  # s of work that a measurement may take


def affordable(seconds: Sequence[float]) -> int:
    """How many of the first trials, which took so long [s], `overhead` can run within BUDGET."""
    return int(np.searchsorted(2 * REPEATS * np.cumsum(seconds), BUDGET, side="right"))


def bare_seconds(trials: Sequence[Trial]) -> float:
    """Time [s] of the experiments' runs alone, one after the other."""
    begin = time.perf_counter()
    for trial in trials:
        _ = load_experiment(trial.experiment).run(trial.config).metrics
    return time.perf_counter() - begin


def overhead(trials: Sequence[Trial], workers: Workers) -> float:
    """Median over REPEATS of (workers x time of the search) / (time of bare runs) - 1.

    Both run the same trials in turns on the same workers, the bare runs in one loop a worker;
    the search on an empty store, with all that it does for a trial.
    """
    shares = [trials[k :: workers.count] for k in range(workers.count)]
    ratios = []
    for _ in range(REPEATS):
        bare = results(workers, bare_seconds, [(share,) for share in shares if share])
        with (
            tempfile.TemporaryDirectory() as folder,
            TrialStore(Path(folder) / "trials.sqlite") as store,
        ):
            run = run_trials(trials, store, workers)
        ratios.append(workers.count * run.seconds / sum(bare) - 1.0)
    return float(np.median(ratios))
