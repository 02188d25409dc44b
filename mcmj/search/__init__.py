"""Searches over bodies and settings: spaces, the store of trials, workers, guided search."""

from mcmj.search.database import TrialStore
from mcmj.search.experiment import Outcome, Score, Trial, evaluate, make_config
from mcmj.search.runner import run_trials
from mcmj.search.workers import open_workers

__all__ = [
    "Outcome",
    "Score",
    "Trial",
    "TrialStore",
    "evaluate",
    "make_config",
    "open_workers",
    "run_trials",
]
