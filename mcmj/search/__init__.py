"""Searches over bodies and settings of any experiment: trials, where they run, where they are kept.

overrides, space    which configs
experiment          one trial: run an experiment under a config, one number of its metrics
database, export    a store of trials in one SQLite file; CSV and Parquet
workers, runner     run trials on one machine or a cluster, each once
summary             success rates by setting
study               guided search over settings (Optuna)
"""
