"""Whole searches: screening and confirmation, guided search, their scripts."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from searches import SET, tiny_trials

import mcmj
from mcmj.core.random_body import draw_body
from mcmj.experiments.guided import run as guided
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.experiments.search import run as search
from mcmj.experiments.search.cost import affordable, overhead
from mcmj.learning.recipe import BODIES
from mcmj.mjcf.kept import provenance_of_model
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.search.experiment import evaluate
from mcmj.search.study import Study
from mcmj.search.workers import Inline
from mcmj.utils.errors import InvalidArgumentError, McmjError, UnknownNameError
from mcmj.utils.files import plain

SCRIPTS = Path(__file__).parents[2] / "scripts"
SMALL = {"set": SET, "seeds": 4, "confirm": 3, "audit": 2, "best": 2, "workers": 1}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    vary = ("teaching.noise=[0.1,0.3]", "settings.feedback_fraction=uniform(0.2,0.6)")
    config = search.Config(**SMALL, vary=vary, draws=2, cost_trials=0)
    scores = []
    store = tmp_path_factory.mktemp("search") / "s.sqlite"
    found = search.run(config, store=store, on_trial=scores.append)
    assert len(scores) == search.total_trials(config) == 16 + 5
    assert search.run(config, store=store).metrics["evaluated"] == 0
    return found


def test_every_setting_meets_every_seed(result):
    assert result.scores.shape == (4, 4)
    assert len({json.dumps(setting) for setting in result.settings}) == 4
    for setting, scores in zip(result.settings, result.scores, strict=True):
        trials = tiny_trials(4, **setting)
        expected = [evaluate(t).metrics["quadratic"]["orbit_error"] for t in trials]
        assert scores.tolist() == expected


def test_the_best_are_confirmed_in_mujoco(result):
    best = [c for c in result.confirmations if c.chosen == "best"]
    assert [c.index for c in best] == np.argsort(result.scores.ravel(), kind="stable")[:3].tolist()
    assert len({c.index for c in result.confirmations}) == 5
    for one in best:  # short runs: the engines still agree to rounding
        assert one.confirmed == pytest.approx(one.screened, rel=1e-6)
        assert one.confirmed != one.screened
    assert result.agreement == 1.0
    row = result.metrics["best"]
    assert row["score"] == result.scores.min()
    assert row["confirmed_score"] == min(c.confirmed for c in best)


def test_the_best_body_is_written_with_its_readout(result):
    assert len(result.bodies) == 2
    row, model = result.metrics["best"], load_model(result.bodies[0])
    account = provenance_of_model(model)
    body, w_out = mcmj.from_mjcf(result.bodies[0])
    fraction = row["setting"]["settings.feedback_fraction"]
    assert body == draw_body(row["seed"], replace(BODIES, nodes=6, feedback_fraction=fraction))
    assert np.array_equal(readouts_of_model(model)["quadratic"], w_out)
    assert (account["screened"], account["confirmed"]) == (row["score"], row["confirmed_score"])
    assert account["config"]["engine"] == "mujoco"
    assert account["searched"] == 16


def test_metrics(result):
    metrics = result.metrics
    assert metrics["trials"] == metrics["evaluated"] == 16
    assert metrics["success_rate"] == (result.scores < 0.05).mean()
    assert metrics["trials_per_second"] > 0
    assert metrics["twin_mujoco_agreement"] == 1.0
    assert [row["of"] for row in metrics["success_by_setting"]["teaching.noise"]] == [8, 8]


def test_an_experiment_without_bodies_or_engines_of_its_own(tmp_path, monkeypatch):
    """A module of the user's own, found by its full name; large is good."""
    (tmp_path / "my_study").mkdir()
    (tmp_path / "my_study" / "study.py").write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\nclass Config:\n    seed: int = 0\n    x: float = 0.0\n"
        "@dataclass\nclass Result:\n    metrics: dict\n"
        "def run(config):\n    return Result({'value': -(config.x - 2.0) ** 2 + config.seed})\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    config = search.Config(
        experiment="my_study.study", vary=("x=uniform(0,4,5)",), seeds=2,
        score="value", threshold=0.5, maximise=True, workers=1, cost_trials=0,
    )  # fmt: skip
    found = search.run(config, store=tmp_path / "s.sqlite")
    assert found.metrics["best"] == {
        "seed": 1, "setting": {"x": 2.0}, "score": 1.0, "confirmed_score": None,
    }  # fmt: skip
    assert (found.bodies, found.confirmations, found.agreement) == ([], [], None)
    assert found.metrics["successes"] == 1


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"experiment": "waltz"}, UnknownNameError, "unknown experiment 'waltz'"),
        ({"set": ("node=3",)}, UnknownNameError, "unknown field of Config 'node'"),
        ({"vary": ("teaching.noise=3",)}, InvalidArgumentError, "teaching.noise: expected"),
        ({"set": ("seed=3",)}, InvalidArgumentError, "each field once, seed excepted, got seed"),
        ({"set": ("windows=0",), "vary": ("windows=[0]",)}, InvalidArgumentError, "got windows"),
        (
            {"engine": "gpu"},
            UnknownNameError,
            "unknown engine 'gpu'; valid choices: mujoco, tendons, twin",
        ),
        ({"workers": 2, "scheduler": "tcp://x:1"}, InvalidArgumentError, "none beside a scheduler"),
        ({"seeds": 0}, InvalidArgumentError, "seeds: expected an integer in [1, 1000000]"),
    ],
)
def test_a_wrong_search_is_refused_before_it_starts(changes, error, text):
    with pytest.raises(error) as caught:
        search.Config(**changes)
    assert text in str(caught.value)


def test_what_searching_costs_on_top(tmp_path):
    """Little; the bound is wide because the machine may be busy with something else."""
    cost = overhead(tiny_trials(4), Inline())
    assert -0.5 < cost < 0.5


def test_the_cost_is_measured_on_as_many_trials_as_run_six_times_within_a_minute():
    assert affordable([1.0] * 24) == 10
    assert affordable([4.0, 5.0, 2.0]) == 2
    assert affordable([0.1] * 24) == 24
    assert affordable([11.0, 0.1]) == affordable([]) == 0


# --- guided ----------------------------------------------------------------------------------

GUIDED = {
    "set": SET, "vary": ("teaching.noise=log(0.01,1)", "teaching.bias=[false,true]"),
    "settings": 5, "startup": 2, "bodies": 2, "judged": 2, "confirm": 1, "workers": 1,
}  # fmt: skip


def test_a_guided_search_interrupted_goes_on_as_if_it_had_not_been(tmp_path):
    pytest.importorskip("optuna")
    whole = guided.run(guided.Config(**GUIDED), folder=tmp_path)
    assert len(whole.tried) == 5
    best = min(objective for _, objective in whole.tried)
    assert (whole.best, best) in whole.tried
    assert whole.confirmed == pytest.approx(whole.judged["guided"][:1], rel=1e-6)
    assert whole.metrics["confirmed"] == whole.metrics["twin_mujoco_agreement"] == 1
    other = tmp_path / "interrupted"
    other.mkdir()
    for stop in (1, 3):
        count = 0

        def interrupt(objective, stop=stop):
            nonlocal count
            count += 1
            if count == stop:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            guided.run(guided.Config(**GUIDED), folder=other, on_setting=interrupt)
    again = guided.run(guided.Config(**GUIDED), folder=other)
    assert again.tried == whole.tried
    assert plain(again.metrics) == plain(whole.metrics)


def test_a_setting_half_done_is_finished_first(tmp_path):
    pytest.importorskip("optuna")
    config = guided.Config(**GUIDED)
    study = Study(tmp_path / "s", ["a"], config.space, 0, startup=3, maximise=False)
    proposed = []

    def die(setting):
        proposed.append(setting)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.advance(die)
    again = Study(tmp_path / "s", ["a"], config.space, 0, startup=3, maximise=False)
    assert again.advance(lambda setting: 3.0) == 3.0
    assert again.told == [(proposed[0], 3.0)]


def test_guided_search_finds_the_minimum_of_a_bowl(tmp_path):
    pytest.importorskip("optuna")
    space = guided.Config(vary=("free_run=log(20,2000)", "teaching.bias=[true,false]")).space
    study = Study(tmp_path / "s", ["bowl"], space, 1, startup=10, maximise=False)
    for _ in range(40):
        study.advance(lambda s: np.log(s["free_run"] / 200.0) ** 2 + s["teaching.bias"])
    setting, value = study.best
    assert setting["teaching.bias"] is False
    assert value < 0.05


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"vary": ()}, "vary: expected at least one field"),
        ({"objective": "mean"}, "unknown objective 'mean'; valid choices: log, median"),
        ({"judged_from": 1}, "judged_from: expected seeds that the search does not use"),
        ({"confirm": -1}, "confirm: expected an integer >= 0"),
        ({"vary": ("teaching.nois=log(1,2)",)}, "unknown field of Teaching 'nois'"),
    ],
)
def test_a_wrong_guided_search_is_refused(tmp_path, changes, text):
    with pytest.raises(McmjError) as caught:
        guided.run(guided.Config(**GUIDED | changes), folder=tmp_path)
    assert text in str(caught.value)


# --- scripts ---------------------------------------------------------------------------------


def run(name, *options):
    command = [sys.executable, SCRIPTS / f"{name}.py", *map(str, options)]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)


def test_the_script_writes_everything(tmp_path):
    done = run(
        "search", "--set", *SET, "--vary", "teaching.noise=log(0.05,0.5,3)", "--seeds", "3",
        "--confirm", "2", "--audit", "1", "--cost-trials", "3", "--workers", "1", "--out", tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "confirmed in MuJoCo: 3 trials" in done.stdout
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"metrics.json", "trials.sqlite", "trials.csv", "best.xml", "success_rate.png",
                     "scores.png", "best_bodies.png"}  # fmt: skip
    document = json.loads((tmp_path / "metrics.json").read_text())
    assert set(document) == {"scenario", "config", "seed", "versions", "metrics"}
    for name in ("trials", "success_rate", "trials_per_second", "overhead_fraction",
                 "twin_mujoco_agreement", "best"):  # fmt: skip
        assert document["metrics"][name] is not None
    seed = document["metrics"]["best"]["seed"]
    assert mcmj.from_mjcf(tmp_path / "best.xml")[0] == draw_body(seed, replace(BODIES, nodes=6))
    assert len((tmp_path / "trials.csv").read_text().splitlines()) == 1 + 9 + 3


@pytest.mark.slow
def test_errors_end_with_a_message(tmp_path):
    (tmp_path / "text.sqlite").write_text("not a database" * 100)
    for options, text in (
        (["--store", tmp_path / "text.sqlite"], "damaged, or not a store"),
        (["--scheduler", "tcp://127.0.0.1:9"], "the address of a Dask scheduler"),
        (["--score", "a.b"], "unknown number of the metrics 'a.b'; valid choices: "),
    ):
        done = run("search", "--set", *SET, "--seeds", "2", "--out", tmp_path, "--quiet", *options)
        assert done.returncode == 1
        assert text in " ".join(done.stderr.split())
        assert "Traceback" not in done.stderr
        assert not (tmp_path / "metrics.json").exists()


@pytest.mark.slow
def test_guided_and_prune_scripts(tmp_path):
    pytest.importorskip("optuna")
    done = run("guided", "--set", *SET, "--settings", "3", "--startup", "1", "--bodies", "2",
               "--judged", "2", "--workers", "1", "--out", tmp_path / "guided")  # fmt: skip
    assert done.returncode == 0, done.stderr
    metrics = json.loads((tmp_path / "guided" / "metrics.json").read_text())["metrics"]
    assert metrics["guided_on_other_bodies"]["of"] == 2
    done = run("prune", "--engine", "twin", "--nodes", "8", "--counts", "3", "9",
               "--duration", "10", "--washout", "2", "--free-run", "13", "--window", "12",
               "--starts", "1", "--out", tmp_path / "prune")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "prune" / "prune.png").stat().st_size > 10_000


def test_limit_cycle_on_the_twin_is_limit_cycle():
    (trial,) = tiny_trials(1)
    runs = {
        engine: limit_cycle.run(
            limit_cycle.Config(**{**vars(trial.config), "engine": engine})
        ).tasks["quadratic"]
        for engine in ("mujoco", "twin")
    }
    assert np.allclose(runs["twin"].outputs, runs["mujoco"].outputs, rtol=0, atol=1e-6)
    assert runs["twin"].positions is None
    assert runs["mujoco"].positions.shape == (12_000, 6, 2)
    assert runs["twin"].windows == {}
