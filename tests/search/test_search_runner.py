"""Trials on workers: the same bits anywhere, each once, whoever is killed."""

import os
import signal
import threading
import time

import psutil
import pytest
from searches import tiny_trials

from mcmj.search.database import TrialStore
from mcmj.search.experiment import Score, check_versions, evaluate, load_experiment
from mcmj.search.runner import run_trials
from mcmj.search.workers import Cluster, Inline, Processes, open_workers
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjError, UnknownNameError

TRIALS = 16


@pytest.fixture(scope="module")
def alone():
    """Metrics by key, one trial after the other in this process."""
    return {trial.key: evaluate(trial).metrics for trial in tiny_trials(TRIALS)}


def metrics_of(run):
    return {key: outcome.metrics for key, outcome in run.outcomes.items()}


class Once:
    """Counts how often each trial is told, and calls back after some of them."""

    def __init__(self, after, act):
        self.keys, self.after, self.act = [], after, act

    def __call__(self, trial, outcome):
        self.keys.append(trial.key)
        if len(self.keys) == self.after:
            self.act()


def check(run, once, store, alone):
    assert metrics_of(run) == alone  # to the bit
    assert sorted(once.keys) == sorted(alone)  # told once each
    assert len(store) == TRIALS


@pytest.mark.slow
def test_a_process_that_is_killed_loses_nothing(tmp_path, alone):
    workers = Processes(2)

    def kill():
        children = psutil.Process().children()
        workers_now = [c for c in children if "spawn_main" in " ".join(c.cmdline())]
        workers_now[0].send_signal(signal.SIGKILL)

    once = Once(5, kill)
    try:
        with TrialStore(tmp_path / "s") as store:
            run = run_trials(tiny_trials(TRIALS), store, workers, on_outcome=once)
            check(run, once, store, alone)
            again = run_trials(tiny_trials(TRIALS), store, Inline())
            assert (again.evaluated, metrics_of(again)) == (0, alone)
    finally:
        workers.close()


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None
    ) as made:
        yield made


@pytest.mark.slow
def test_a_cluster_worker_that_is_killed_loses_nothing(tmp_path, alone, cluster):
    def kill():
        worker = next(iter(cluster.workers.values()))
        os.kill(worker.pid, signal.SIGKILL)

    once = Once(5, kill)
    with (
        open_workers(None, cluster.scheduler_address) as workers,
        TrialStore(tmp_path / "s") as store,
    ):
        assert workers.count >= 2
        run = run_trials(tiny_trials(TRIALS), store, workers, on_outcome=once)
        check(run, once, store, alone)
        assert run.evaluated == TRIALS


def test_two_runs_on_one_store_share_the_trials(tmp_path, alone):
    found = []

    def search():
        with TrialStore(tmp_path / "s") as store:
            found.append(run_trials(tiny_trials(TRIALS), store, Inline()))

    threads = [threading.Thread(target=search) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [metrics_of(run) for run in found] == [alone, alone]
    assert sum(run.evaluated for run in found) == TRIALS


def test_a_trial_that_blows_up_is_an_outcome(tmp_path):
    wild = tiny_trials(1, **{"settings.feedback_scale": 1e7})
    with pytest.raises(DivergenceError):
        load_experiment("limit_cycle").run(wild[0].config)
    with TrialStore(tmp_path / "s") as store:
        run = run_trials(wild, store, Inline())
    (outcome,) = run.outcomes.values()
    assert (outcome.status, outcome.metrics) == ("diverged", {})
    assert "blew up after t = " in outcome.message
    assert Score("*/orbit_error", 0.05).of(outcome) == float("inf")
    assert Score("*/orbit_error", 0.05, maximise=True).of(outcome) == -float("inf")


def test_a_trial_that_cannot_run_ends_the_search_and_what_is_done_is_kept(tmp_path):
    (bad,) = tiny_trials(1, **{"settings.n_outputs": 3})
    with TrialStore(tmp_path / "s") as store:
        with pytest.raises(InvalidArgumentError, match="2 feedback channels"):
            run_trials([*tiny_trials(3), bad], store, Inline())
        assert len(store) == 3


def test_experiments_by_name():
    assert load_experiment("mcmj.experiments.perturb.run") is load_experiment("perturb")
    with pytest.raises(UnknownNameError, match=r"'waltz'; valid choices: .*limit_cycle.*swing_up"):
        load_experiment("waltz")
    with pytest.raises(InvalidArgumentError, match="a module with Config and run"):
        load_experiment("mcmj.core.body")


def test_other_versions_on_a_worker_are_named():
    outcome = evaluate(tiny_trials(1)[0])
    check_versions(outcome)
    outcome.versions["numpy"] = "0.1"
    with pytest.raises(McmjError, match=r"a worker has numpy 0\.1, this machine"):
        check_versions(outcome)


def test_scores():
    outcome = evaluate(tiny_trials(1, task="all", free_run=20, window=19)[0])
    score = Score("*/orbit_error", 0.05)
    errors = [task["orbit_error"] for task in outcome.metrics.values() if isinstance(task, dict)]
    assert sorted(score.parts(outcome).values()) == sorted(errors)
    assert score.of(outcome) == max(errors)
    assert Score("*/orbit_error", 0.05, maximise=True).of(outcome) == min(errors)
    with pytest.raises(UnknownNameError, match=r"lissajous/orbit_error"):
        Score("*/orbit", 0.05).of(outcome)


@pytest.mark.parametrize("address", ["nowhere", "", "tcp://", "tcp://127.0.0.1:99999"])
def test_what_is_no_scheduler_s_address_is_refused_at_once(address):
    pytest.importorskip("distributed")
    began = time.monotonic()
    with pytest.raises(InvalidArgumentError, match="the address of a Dask scheduler"):
        Cluster(address)
    assert time.monotonic() - began < 5.0


def test_no_scheduler_there():
    pytest.importorskip("distributed")
    with pytest.raises(InvalidArgumentError, match="the address of a Dask scheduler"):
        Cluster("tcp://127.0.0.1:9", patience=0.5)
