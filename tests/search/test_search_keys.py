"""The key of a trial: it knows all that the run reads, so edited code never gives old scores."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from searches import tiny_trials

from mcmj.experiments.certify import run as certify
from mcmj.mjcf.bundled import body_path
from mcmj.search import experiment
from mcmj.search.experiment import Trial, evaluate, load_experiment
from mcmj.utils.errors import McmjError, UnknownNameError

MODULE = """
from dataclasses import dataclass
from types import SimpleNamespace
from dances.steps import SCORE

@dataclass(frozen=True)
class Config:
    seed: int = 0

def run(config):
    return SimpleNamespace(metrics={"score": SCORE})
"""
PROGRAM = """
import sys
from pathlib import Path
from mcmj.search import Trial, TrialStore, make_config, run_trials
from mcmj.search.workers import Inline
trial = Trial("dances.waltz", make_config("dances.waltz", {}))
with TrialStore(sys.argv[1]) as store:
    print(run_trials([trial], store, Inline()).outcomes[trial.key].metrics["score"])
"""


def test_edited_code_never_gives_old_scores(tmp_path):
    package = tmp_path / "dances"
    package.mkdir()
    (package / "waltz.py").write_text(MODULE)
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])])

    def score():
        return subprocess.run(
            [sys.executable, "-B", "-c", PROGRAM, tmp_path / "s"],
            env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip

    (package / "steps.py").write_text("SCORE = 1")
    assert score() == score() == "1\n"
    (package / "steps.py").write_text("SCORE = 2")  # a module that the experiment imports
    assert score() == "2\n"


def test_the_key_knows_the_content_of_the_body_file(tmp_path):
    file = tmp_path / "b.xml"
    text = body_path("general").read_text()
    keys = set()
    for content in (text, text, text + " "):
        file.write_text(content)
        keys.add(Trial("certify", certify.Config(body=str(file))).key)
    assert len(keys) == 2


def test_the_key_knows_the_curve_behind_a_name(tmp_path):
    file = tmp_path / "circle.csv"
    keys = set()
    for size in (1.0, 1.0, 2.0):
        angles = 2 * np.pi * np.arange(50) / 50
        circle = np.column_stack([0.1 * np.arange(50), size * np.sin(angles), np.cos(angles)])
        np.savetxt(file, circle, delimiter=",", header="time,x1,x2", comments="")
        keys.add(Trial("certify", certify.Config(task=str(file))).key)
    assert len(keys) == 2


def test_the_key_knows_the_version_of_mujoco(monkeypatch):
    before = tiny_trials(1)[0].key
    here = experiment.versions()
    monkeypatch.setattr(experiment, "versions", lambda: here | {"mujoco": "9.9.9"})
    assert tiny_trials(1)[0].key != before


def test_a_file_edited_while_the_search_runs_is_noticed(tmp_path):
    @dataclass(frozen=True)
    class Config:
        data: Path

    (tmp_path / "data").write_text("1")
    trial = Trial("limit_cycle", Config(tmp_path / "data"))
    trial.key  # noqa: B018  # as when it is looked up in the store
    (tmp_path / "data").write_text("2")
    with pytest.raises(McmjError, match="not what the search began with"):
        evaluate(trial)


@pytest.mark.parametrize("name", ["../x", "", ".", "a..b", "x y", "limit_cycle."])
def test_names_that_no_module_has_are_refused(name):
    with pytest.raises(UnknownNameError, match="unknown experiment"):
        load_experiment(name)
