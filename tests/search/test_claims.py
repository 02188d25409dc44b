"""Several searches at one store: nothing is run twice, and nothing is lost with a process."""

import json
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from searches import SET, tiny_trials

from mcmj.search import database
from mcmj.search.database import TrialStore
from mcmj.search.experiment import evaluate
from mcmj.search.runner import run_trials
from mcmj.search.workers import Inline

SEARCH = Path(__file__).parents[2] / "scripts" / "search.py"


def test_a_claim_keeps_others_off_until_it_ends(tmp_path):
    keys = ["a", "b", "c"]
    with TrialStore(tmp_path / "s") as one, TrialStore(tmp_path / "s") as two:
        assert one.claim(keys[:2]) == {"a", "b"}
        assert two.claim(keys) == {"c"}
        assert one.claim(keys) == {"a", "b"}  # its own, again
        one.close()
        assert two.claim(keys) == set(keys)


def test_a_claim_not_renewed_is_void(tmp_path, monkeypatch):
    with TrialStore(tmp_path / "s") as one, TrialStore(tmp_path / "s") as two:
        monkeypatch.setattr(database, "LEASE", -1.0)
        one.claim(["a", "b"])
        monkeypatch.undo()
        assert two.claim(["a"]) == {"a"}
        one.renew()
        assert two.claim(["b"]) == set()


def test_the_claims_of_a_killed_process_are_void_at_once(tmp_path):
    code = (
        "import sys, time; from mcmj.search.database import TrialStore\n"
        "store = TrialStore(sys.argv[1]); print(store.claim(['a']), flush=True); time.sleep(60)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, tmp_path / "s"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "{'a'}\n"
    with TrialStore(tmp_path / "s") as store:
        assert store.claim(["a"]) == set()
        process.kill()
        process.wait()
        process.stdout.close()
        assert store.claim(["a"]) == {"a"}


def test_a_claim_dated_far_ahead_is_void(tmp_path, monkeypatch):
    with TrialStore(tmp_path / "s") as one, TrialStore(tmp_path / "s") as two:
        monkeypatch.setattr(database, "LEASE", 1e9)
        one.claim(["a"])
        monkeypatch.undo()
        assert two.claim(["a"]) == {"a"}


def start_search(folder, store, *options):
    command = [sys.executable, SEARCH, "--set", *SET, "--seeds", "40", "--confirm", "0", "--audit",
               "0", "--cost-trials", "0", "--best", "1", "--quiet", "--workers", "1",
               "--store", store, "--out", folder, *options]  # fmt: skip
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def trials_in(path):
    try:
        db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        return dict(db.execute("SELECT key, finished || seconds FROM trials").fetchall())
    except sqlite3.OperationalError:  # not made yet
        return {}


def until(path, count, process):
    end = time.monotonic() + 120
    while len(trials_in(path)) < count:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.005)


def kill_at(folder, store, count):
    """Start a search and kill it once so many trials are in the store; returns what is there."""
    process = start_search(folder, store)
    until(store, count, process)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert not (folder / "metrics.json").exists()
    kept = trials_in(store)
    assert len(kept) >= count
    return kept


@pytest.mark.slow
def test_a_killed_search_goes_on_where_it_was(tmp_path):
    store = tmp_path / "trials.sqlite"
    kept = kill_at(tmp_path, store, 5)
    trials = tiny_trials(40)
    with TrialStore(store) as again:
        run = run_trials(trials, again, Inline())
        assert run.evaluated == 40 - len(kept)
    assert kept.items() <= trials_in(store).items()  # finished trials were not run again
    assert run.outcomes.keys() == trials_in(store).keys() == {trial.key for trial in trials}
    alone = {trial.key: evaluate(trial).metrics for trial in trials}
    assert {key: found.metrics for key, found in run.outcomes.items()} == alone  # to the bit


@pytest.mark.slow
def test_a_search_killed_twice_and_two_at_once(tmp_path):
    store, folders = tmp_path / "trials.sqlite", [tmp_path / "one", tmp_path / "two"]
    kill_at(folders[0], store, 3)
    kept = kill_at(folders[1], store, 11)
    both = [start_search(folder, store) for folder in folders]
    for process in both:
        _, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
    everything = trials_in(store)
    assert len(everything) == 40
    assert kept.items() <= everything.items()
    shares = [
        json.loads((folder / "metrics.json").read_text())["metrics"]["evaluated"]
        for folder in folders
    ]
    assert sum(shares) == 40 - len(kept)  # none by both
    assert min(shares) > 0


def test_many_searches_may_make_one_store_at_the_same_moment(tmp_path):
    """Eight threads behind a barrier, forty new stores: nobody is refused."""
    refused = []

    def enter(path, barrier):
        barrier.wait()
        try:
            with TrialStore(path) as store:
                assert len(store) == 0
        except Exception as error:
            refused.append(error)

    for number in range(40):
        barrier = threading.Barrier(8)
        path = tmp_path / f"store{number}"
        threads = [threading.Thread(target=enter, args=(path, barrier)) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not refused
