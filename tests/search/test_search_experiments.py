"""A search of an experiment over seeds is that experiment's own table over seeds, to the bit."""

import re
import shlex
from pathlib import Path
from typing import Annotated

import pytest
import tyro
from searches import TINY

from mcmj.experiments.guided import run as guided
from mcmj.experiments.search import run as search
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.search.experiment import (
    Score,
    Trial,
    default_score,
    evaluate,
    load_experiment,
    make_config,
    trained_body,
)
from mcmj.utils.files import plain

SEEDS = 2
TWIN = {"engine": "twin", "settings.nodes": 12}
TAUGHT = {"teaching.duration": 20.0, "teaching.washout": 5.0, "teaching.rest_runs": 0,
          "teaching.held_runs": 0}  # fmt: skip
PRACTICE = {"practice.rounds": 1, "practice.round_duration": 5.0, "practice.trial": 12.0,
            "practice.trial_window": 10.0}  # fmt: skip
PERTURB = {**TWIN, **TAUGHT, **PRACTICE, "before": 1.0, "window": 1.0, "after": 16.0,
           "error_window": 12.0}  # fmt: skip
SWING_UP = {**TWIN, **TAUGHT, **PRACTICE, "task": "quadratic", "free_run": 15.0, "window": 12.0}
GAITS = {**TWIN, **TAUGHT, **PRACTICE, "gaits": ["trot", "bound"], "free_run": 10.0,
         "before": 1.0, "after": 10.0, "from_rest": 10.0, "window": 10.0, "phases": 1}  # fmt: skip
INPUT = {**TWIN, **PRACTICE, "profile": "lin 1 2 15, hold 2 10", "run_in": 5.0,
         "inputs": [2.0, 1.2], "free_run": 16.0, "window": 9.0, "noise": 0.3}  # fmt: skip


def named_errors(table):
    """Orbit errors by name, of rows that have a list of them."""
    return {
        name: row["orbit_errors"]
        for name, row in table.items()
        if isinstance(row, dict) and "orbit_errors" in row
    }


def outcomes(table):
    """Whether a body succeeds, by what it succeeds in."""
    kinds = ("free_run", "switch", "from_rest")
    return {kind: [one[kind] for one in table["outcomes"]] for kind in kinds}


TABLES = [
    ("perturb", PERTURB, "seeds", named_errors),
    ("swing_up", SWING_UP, "seeds", named_errors),
    ("input_driven", INPUT, "rates", named_errors),
    ("gaits", GAITS, "seeds", outcomes),
]


@pytest.mark.parametrize(("name", "changes", "key", "read"), TABLES, ids=[t[0] for t in TABLES])
def test_a_search_over_seeds_is_the_table_of_the_experiment(name, changes, key, read):
    trials = [Trial(name, make_config(name, changes | {"seed": k})) for k in range(SEEDS)]
    score = Score(default_score(name), 0.05)
    parts = [score.parts(evaluate(trial)) for trial in trials]
    ours = {score.label(path): [one[path] for one in parts] for path in parts[0]}
    whole = make_config(name, changes | {"seeds": SEEDS})
    table = read(plain(load_experiment(name).run(whole).metrics[key]))
    assert table.keys() <= ours.keys()
    for part, theirs in table.items():
        if read is outcomes:
            assert [score.succeeds(x) for x in ours[part]] == theirs
        else:
            assert [None if x == score.worst else x for x in ours[part]] == theirs
    model = load_model(trained_body(trials[0], {}))
    assert readouts_of_model(model)


def test_searches_leave_out_what_they_do_not_need():
    """And nothing else: all other fields are the experiment's own."""
    left_out = {
        "limit_cycle": {"windows": 0.0, "measure_cost": False},
        "perturb": {"noise_curve": ()},
        "swing_up": {"kicks": 0},
        "gaits": {},
        "input_driven": {"curve": (), "sweep": 0.0},
    }
    for name, fields in left_out.items():
        default, config = load_experiment(name).Config(), make_config(name, {})
        assert vars(config) == vars(default) | fields
    assert make_config("limit_cycle", {"windows": 50}).windows == 50.0
    assert default_score("limit_cycle") == "*/orbit_error"


def test_the_score_of_an_experiment_is_its_own_unless_told_otherwise():
    settings = tuple(f"{path}={value}" for path, value in TINY.items() if path != "engine")
    assert search.Config(set=settings, seeds=1).target.path == "*/orbit_error"
    assert search.Config(experiment="gaits", seeds=1).target.path == "worst_error/*"
    assert guided.Config(experiment="gaits", set=(), vary=("phases=int(1,3)",)).target.path == (
        "worst_error/*"
    )
    assert search.Config(set=settings, seeds=1, score="a/b").target.path == "a/b"


ROOT = Path(__file__).parents[2]
BLOCKS = [
    block
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    for block in re.findall(r"```sh\n(.*?)```", page.read_text(), re.S)
]
COMMANDS = sorted(
    {
        line
        for block in BLOCKS
        for line in block.replace("\\\n", " ").splitlines()
        if re.match(r"sh scripts/run\.sh (search|guided) ", line)
    }
)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_commands_of_the_docs_name_fields_and_experiments_that_exist(command):
    _, _, name, *options = shlex.split(command, comments=True)
    config_type = {"search": search.Config, "guided": guided.Config}[name]
    config = tyro.cli(Annotated[config_type, tyro.conf.OmitArgPrefixes], args=options)
    assert config.target.path
    assert config.space is not None
