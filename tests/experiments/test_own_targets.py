"""A target of one's own in every command that takes a task."""

import json

import numpy as np
import pytest
from test_contract import TINY

from mcmj.experiments.base import Output, carry_out
from mcmj.experiments.command_line import main, parse
from mcmj.experiments.registry import entries, experiment_named
from mcmj.mjcf.bundled import open_body
from mcmj.targets.limit_cycles import target

WITH_TASK = [name for name in entries() if hasattr(experiment_named(name).config, "task")]
SLOW = [
    pytest.param(name, marks=() if name in ("limit_cycle", "perturb") else pytest.mark.slow)
    for name in WITH_TASK
]
PROGRAM = "from mcmj.targets.limit_cycles import quadratic\ndef mine(): return quadratic(5.0)\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The quadratic cycle as mine.csv, and by my_rhythms:mine."""
    folder, goal = tmp_path_factory.mktemp("own"), target("quadratic")
    times = goal.period * np.arange(300) / 300
    table = np.column_stack([times, goal.sample(times)])
    np.savetxt(folder / "mine.csv", table, delimiter=",", header="time,x1,x2", comments="")
    (folder / "my_rhythms.py").write_text(PROGRAM)
    return folder


def options_of(name, task):
    given = TINY[name].split()
    if "--task" in given:
        at = given.index("--task")
        del given[at : at + 2]
    if name == "certify":  # the readout in the file is the known target's
        given += ["--duration", "60"]
    return [*given, "--task", str(task)]


def test_the_commands_that_take_a_task():
    assert set(WITH_TASK) == {
        "adopt", "certify", "design", "drive", "limit_cycle", "perturb", "prune", "render",
        "success_rate", "swing_up",
    }  # fmt: skip


@pytest.mark.parametrize("name", SLOW)
def test_a_curve_in_a_file_is_a_task(name, place, tmp_path):
    experiment = experiment_named(name)
    config, _ = parse(experiment, options_of(name, place / "mine.csv"))
    carry_out(experiment, config, Output(quiet=True, video=False), tmp_path)
    document = json.loads((tmp_path / "metrics.json").read_text())
    assert document["config"]["task"] == str(place / "mine.csv")
    assert list(tmp_path.glob("*.png"))
    if name in ("limit_cycle", "success_rate", "swing_up"):
        metrics = document["metrics"]
        assert "mine" in metrics.get("tasks", metrics)


@pytest.mark.parametrize("name", WITH_TASK)
def test_a_python_name_is_a_task_and_a_wrong_one_an_error(name, place, monkeypatch, capsys):
    monkeypatch.syspath_prepend(place)
    config, _ = parse(experiment_named(name), options_of(name, "my_rhythms:mine"))
    assert config.task == "my_rhythms:mine"
    for task in ("my_rhythms:yours", "nowhere.csv", "waltz"):
        with pytest.raises(SystemExit) as caught:
            main([name, "--task", task])
        told = capsys.readouterr().err + str(caught.value.code)
        assert "task" in told
        assert task in told
        assert "quadratic" in told


def test_a_body_taught_by_ones_own_target_is_found_taught(place, tmp_path, capsys):
    task = ["--task", str(place / "mine.csv"), "--no-video", "--quiet"]
    short = ["--duration", "8", "--washout", "2", "--free-run", "13", "--window", "12"]
    short += ["--no-measure-cost", "--rest-runs", "0", "--held-runs", "0", "--rounds", "0"]
    short += ["--trial", "13", "--trial-window", "12"]
    main(["limit_cycle", *task, *short, "--nodes", "12", "--out", str(tmp_path / "one")])
    body = str(tmp_path / "one" / "body.xml")
    assert list(open_body(body).readouts) == ["mine"]
    main(["limit_cycle", *task, *short, "--body", body, "--out", str(tmp_path / "two")])
    again = json.loads((tmp_path / "two" / "metrics.json").read_text())["metrics"]["mine"]
    assert again["train_nrmse"] is None  # not taught again
    capsys.readouterr()


@pytest.mark.parametrize("name", ["certify", "limit_cycle", "perturb", "prune", "render"])
def test_a_body_with_other_outputs_is_refused(name, place, tmp_path, capsys):
    options = ["--task", str(place / "mine.csv"), "--body", "gaits", "--out", str(tmp_path)]
    with pytest.raises(SystemExit, match=f"{name}: error: body: expected 2 feedback channels"):
        main([name, *options, "--quiet"])
    assert not list(tmp_path.iterdir())
