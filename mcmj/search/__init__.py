"""Searches over bodies and settings of any experiment: trials, where they run, where they are kept.

overrides, space    which configs
experiment          one trial: run an experiment under a config, one number of its metrics
database, export    a store of trials in one SQLite file; CSV and Parquet
workers, runner     run trials on one machine or a cluster, each once
summary             success rates by setting
study               guided search over settings (Optuna)
"""

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
