"""Small real trials for the tests of searches: milliseconds each."""

from mcmj.search.experiment import Trial, make_config

TINY = {
    "task": "quadratic",
    "engine": "twin",
    "free_run": 13.0,
    "window": 12.0,
    "teaching.duration": 3.0,
    "teaching.washout": 1.0,
    "teaching.rest_runs": 0,
    "teaching.held_runs": 0,
    "practice.rounds": 0,
    "practice.trial": 12.0,
    "practice.trial_window": 10.0,
    "settings.nodes": 6,
}
SET = tuple(f"{path}={value}" for path, value in TINY.items() if path != "engine")


def tiny_trials(count, **changes):
    return [
        Trial("limit_cycle", make_config("limit_cycle", {**TINY, **changes, "seed": seed}))
        for seed in range(count)
    ]
