"""What holds for every experiment of the registry, those that are still to be written included."""

import json
from dataclasses import fields
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest

from mcmj.experiments.base import Output, carry_out
from mcmj.experiments.command_line import default_folder, main, parse
from mcmj.experiments.registry import GROUPS, entries, experiment_named
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.files import plain

ON_CYCLE = "--rest-runs 0 --held-runs 0"
UNPRACTISED = "--rounds 0 --trial 13 --trial-window 12"
TAUGHT = f"--task quadratic --seed 0 --nodes 12 --engine twin --duration 12 --washout 4 {ON_CYCLE}"
TINY = {
    "adopt": "--model soft_arm --seeds 1 --periods 5 --rounds 0 --free-run 4 --after 4 --window 3 "
    "--symbols 200 --streams 3",
    "benchmark": "--steps 20 --repeats 1 --sizes 10 --memory-steps 1000 --trials limit_cycle",
    "capacity": "--nodes 8 --symbols 150 --washout 20 --max-delays 5 2 --streams 6 "
    "--stream-symbols 12 --no-maps",
    "certify": "--task quadratic --body quadratic --free-run 15 --window 13 --recovery 22 "
    "--scales 1 --phases 1 --kicks 0.5 --pushes 1 --copies 4 --refine 2",
    "design": "--nodes 6 --seeds 2 --evaluations 3 --checks 1 --judged 1 --free-run 26 --duration "
    "12 --washout 4 --parts bodies smallest --tasks van_der_pol --sizes 4 --workers 1",
    "drive": "--nodes 8 --rounds 1 --population 2 --elites 2 --time-limit 8 --drive 4",
    "emulate": "--targets van_der_pol --integrators Euler --steps-ms 1 2 --horizon 1",
    "filters": "--tasks volterra --nodes 10 --train 3 --washout 1 --test 2 --engine twin",
    "gaits": "--gaits trot pace --seed 3 --nodes 12 --engine twin --duration 10 --washout 4 "
    "--free-run 8 --before 5 --after 10 --from-rest 8 --window 8 --rounds 0 --phases 2",
    "guided": "--experiment limit_cycle --vary teaching.noise=log(0.05,0.5) --set task=quadratic "
    "settings.nodes=12 teaching.duration=12.0 teaching.washout=4.0 teaching.rest_runs=0 "
    "teaching.held_runs=0 practice.rounds=0 practice.trial=13.0 practice.trial_window=12.0 "
    "free_run=14.0 window=12.0 "
    "--settings 3 --bodies 1 --judged 1 --confirm 0 --workers 1",
    "hard_cases": "--cases ordinary --integrators Euler --duration 0.05 --most-steps 200",
    "input_driven": "--engine twin --seed 1 --nodes 15 --free-run 14 --window 13 --sweep 0 "
    "--rounds 0 --inputs 1 --curve 2",
    "limit_cycle": "--task quadratic --seed 3 --nodes 12 --duration 8 --washout 2 --free-run 13 "
    f"--window 12 --no-measure-cost {ON_CYCLE} {UNPRACTISED}",
    "linearise": "--sizes 2 --memory-sizes 2 --diversities 1 0.1 --train 5 --test 2 --washout 1 "
    "--symbolic-masses 2",
    "perturb": f"{TAUGHT} {UNPRACTISED} --before 1 --window 1 --after 15 --error-window 12 "
    "--noise-curve 0.1",
    "prune": f"{TAUGHT} --free-run 20 --window 12 --counts 3 10 --starts 1",
    "render": "--duration 0.3 --formats png --stills 1",
    "search": "--seeds 2 --set task=quadratic settings.nodes=12 teaching.duration=12.0 "
    "teaching.washout=4.0 teaching.rest_runs=0 teaching.held_runs=0 practice.rounds=0 "
    "practice.trial=13.0 practice.trial_window=12.0 "
    "free_run=14.0 window=12.0 --confirm 1 --audit 1 --cost-trials 2 "
    "--workers 1",
    "speed_accuracy": "--bodies toolbox_n10 --methods mujoco_Euler mujoco_RK4 --steps-ms 1 2 "
    "--repeats 1 --no-attractor",
    "success_rate": "--seeds 2 --nodes 10 --duration 6 --washout 2 --free-run 20 --window 19 "
    f"--engine twin {ON_CYCLE} {UNPRACTISED}",
    "swing_up": f"{TAUGHT} {UNPRACTISED} --free-run 15 --window 12 --kicks 1",
    "soft_robot": (
        "--seed 100 --gaits trot --parts energy --walking 3 --judged 1 --rounds 1 "
        "--round-duration 3 --trial 1"
    ),
    "trunk": "--gaits trot --parts --walking 3 --judged 1 --rounds 1 --round-duration 4 --trial 2",
    "walk": "--parts walk --gaits trot --settle 2 --walking 3 --before 2 --after 2",
}
RECORDED = Path(__file__).parents[1] / "data" / "recorded"  # support/record.py
TINY["fit"] = " ".join(
    f"--{name} {RECORDED}/{name}.csv" for name in ("signals", "targets", "inputs")
)
APART = {"reproduce", "view", "web"}  # commands, a person, npm; tested on their own
TIMED = {  # metrics that are times, by path; all others are the same in every run
    "benchmark": ("*",),
    "design": ("*/seconds_per_body",),
    "guided": ("*per_second",),
    "render": ("*_ms",),
    "search": ("trials_per_second", "overhead_fraction"),
    "speed_accuracy": ("*/us_per_simulated_second", "*/cost_ratio*"),
}
SLOW = dict.fromkeys(("benchmark", "certify", "input_driven", "success_rate"), pytest.mark.slow)
BAD = {  # an option that the experiment must refuse by its name, where it is not --seed
    "render": ("--stills", "0"), "guided": ("--bodies", "0"), "search": ("--seeds", "0"),
    "success_rate": ("--seeds", "0"), "gaits": ("--seeds", "0"), "limit_cycle": ("--window", "-1"),
    "perturb": ("--seeds", "0"), "prune": ("--seeds", "0"), "swing_up": ("--seeds", "0"),
    "certify": ("--copies", "0"), "adopt": ("--seeds", "0"),
    "fit": ("--washout", "-1"),
}  # fmt: skip


def numbers(value, path=""):
    """All numbers of a JSON document by their path; null is NaN."""
    if isinstance(value, dict):
        return {
            k: n for key, one in value.items() for k, n in numbers(one, f"{path}/{key}").items()
        }
    if isinstance(value, list):
        return {k: n for i, one in enumerate(value) for k, n in numbers(one, f"{path}/{i}").items()}
    if isinstance(value, str | bool):
        return {}
    return {path: np.nan if value is None else value}


def carried_out(name, folder):
    experiment = experiment_named(name)
    config, _ = parse(experiment, TINY[name].split())
    folder.mkdir()
    carry_out(experiment, config, Output(quiet=True, video=False), folder)
    return json.loads((folder / "metrics.json").read_text())


def test_the_registry_is_complete():
    assert set(entries()) == set(TINY) | APART
    for entry in entries().values():
        assert entry.group in GROUPS
        assert 10 < len(entry.line) < 60
    with pytest.raises(
        UnknownNameError, match="unknown experiment 'waltz'; valid choices: adopt, bench"
    ):
        experiment_named("waltz")


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW.get(name, ())) for name in TINY])
def test_an_experiment_runs_is_deterministic_and_draws(name, tmp_path):
    one, two = (carried_out(name, tmp_path / place) for place in ("one", "two"))
    assert one["scenario"] == name
    assert isinstance(one["seed"], int)
    found, again = numbers(one["metrics"]), numbers(two["metrics"])
    # null is what a run so short does not have: a period, a time of recovery
    assert np.isfinite(list(found.values())).mean() > 0.5
    for path, value in found.items():
        if not any(fnmatch(path[1:], timed) for timed in TIMED.get(name, ())):
            assert again[path] == value or (np.isnan(value) and np.isnan(again[path])), path
    pictures = list((tmp_path / "one").glob("*.png"))
    assert pictures
    assert all(path.stat().st_size > 5_000 for path in pictures)
    assert not [path for path in (tmp_path / "one").iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("name", sorted({*TINY, *APART} - {"reproduce"}))
def test_a_config_is_frozen_has_defaults_and_refuses_what_is_bad(name, capsys):
    experiment = experiment_named(name)
    config = experiment.config()
    assert plain(config)  # JSON types
    assert isinstance(experiment.seed(config), int)
    with pytest.raises(AttributeError):
        setattr(config, fields(config)[0].name, None)
    option, value = BAD.get(name, ("--seed", "-1"))
    with pytest.raises(SystemExit) as caught:
        main([name, option, value, "--quiet"])
    told = capsys.readouterr().err + str(caught.value)
    assert caught.value.code not in (0, None)
    assert option.lstrip("-").replace("-", "_") in told


def test_the_folder_of_results_is_named_by_the_options():
    experiment = experiment_named("limit_cycle")

    def folder(*options):
        return str(default_folder(experiment, parse(experiment, options)[0]))

    assert folder() == "results/limit_cycle"
    assert folder("--task", "quadratic", "--noise", "0.4") == (
        "results/limit_cycle-task=quadratic-noise=0.4"
    )
    assert folder("--body", "../a b.xml") == "results/limit_cycle-body=.._a_b.xml"
    long = [folder("--body", "x" * 100 + end) for end in "ab"]
    assert long[0] != long[1]
    assert all(len(name) < 100 for name in long)
