"""The store of trials: nothing lost, nothing twice, clear errors, nothing damaged."""

import csv
import os
import sqlite3
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest
from searches import tiny_trials

from mcmj.search.database import TrialStore
from mcmj.search.experiment import Outcome, Trial, make_config
from mcmj.search.export import table, write_csv, write_parquet
from mcmj.search.runner import run_trials
from mcmj.search.workers import Inline
from mcmj.utils.errors import InvalidArgumentError, McmjError, OutputError, StoreError


def outcome(error=0.25, **changes):
    found = {"quadratic": {"orbit_error": error, "windows": [1.0, None]}, "n": 3}
    fields = {
        "status": "done",
        "metrics": found,
        "message": "",
        "seconds": 0.5,
        "versions": {"a": "1"},
    }
    return Outcome(**fields | changes)


def filled(path, count=3):
    trials = tiny_trials(count)
    with TrialStore(path) as store:
        for k, trial in enumerate(trials):
            store.add(trial, outcome(0.1 * k))
    return trials


def test_what_goes_in_comes_out(tmp_path):
    trials = filled(tmp_path / "a.sqlite")
    lost = outcome(status="diverged", metrics={}, message="blew up")
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.add(tiny_trials(4)[3], lost)
        assert len(store) == 4
        keys = [trial.key for trial in tiny_trials(6)]
        found = store.outcomes(keys)
        assert found == {t.key: outcome(0.1 * k) for k, t in enumerate(trials)} | {keys[3]: lost}
        rows = {row["seed"]: row for row in store.rows()}
        assert rows[2]["config"]["settings"]["nodes"] == 6
        assert rows[2]["versions"] == {"a": "1"}


def test_the_first_outcome_of_a_trial_stays(tmp_path):
    (trial,) = filled(tmp_path / "a.sqlite", 1)
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.add(trial, outcome(9.0))
        assert store.outcomes([trial.key])[trial.key] == outcome(0.0)


def test_keys_tell_trials_apart():
    one, other = tiny_trials(2)
    assert one.key == tiny_trials(1)[0].key != other.key
    changed = [
        Trial("perturb", make_config("perturb", {"seed": 0})),
        *tiny_trials(1, **{"teaching.noise": 0.2000001}),
        *tiny_trials(1, engine="mujoco"),
    ]
    assert len({one.key, *(trial.key for trial in changed)}) == 4


@pytest.mark.parametrize("way", ["deleted", "replaced"])
def test_a_store_gone_in_mid_run_is_noticed_at_the_next_write(tmp_path, way):
    path = tmp_path / "a.sqlite"
    filled(tmp_path / "other.sqlite", 1)
    with TrialStore(path) as store:
        store.add(tiny_trials(1)[0], outcome())
        if way == "deleted":
            path.unlink()
        else:
            (tmp_path / "other.sqlite").replace(path)
        for write in (store.renew, lambda: store.claim(["a"])):
            with pytest.raises(OutputError, match="deleted or replaced while it was in use"):
                write()


def test_outcomes_of_other_versions_are_refused(tmp_path):
    trials = tiny_trials(1)
    with TrialStore(tmp_path / "a.sqlite") as store:
        store.add(trials[0], outcome(versions={"numpy": "0.1"}))
        with pytest.raises(McmjError, match=r"a\.sqlite: a trial kept there has numpy 0\.1"):
            run_trials(trials, store, Inline())


# --- files that are not what they should be --------------------------------------------------


def test_a_store_of_another_schema_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "a.sqlite"
    filled(path)
    db = sqlite3.connect(path)
    db.execute("PRAGMA user_version = 7")
    db.close()
    before = path.read_bytes()
    with pytest.raises(StoreError, match="a store of schema version 7, this mcmj has version 2"):
        TrialStore(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("column", "value"),
    [("metrics", "{"), ("metrics", "[]"), ("metrics", b"\xff"), ("versions", "null"),
     ("status", "fine"), ("seconds", "long"), ("metrics", "[" * 100_000)],
)  # fmt: skip
def test_a_damaged_row_is_named(tmp_path, column, value):
    path = tmp_path / "a.sqlite"
    (trial,) = filled(path, 1)
    db = sqlite3.connect(path)
    db.execute(f"UPDATE trials SET {column} = ?", [value])
    db.commit()
    db.close()
    with TrialStore(path) as store:
        with pytest.raises(StoreError, match=f"the row of trial {trial.key} is damaged") as caught:
            store.outcomes([trial.key])
        assert "\n" not in str(caught.value)
        if column not in ("status", "seconds"):
            with pytest.raises(StoreError, match="is damaged"):
                list(store.rows())


def test_another_program_s_database_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "other.sqlite"
    db = sqlite3.connect(path)
    db.execute("CREATE TABLE recipes (name TEXT)")
    db.commit()
    db.close()
    before = path.read_bytes()
    with pytest.raises(StoreError, match="not a store of mcmj's trials"):
        TrialStore(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("damage", ["text", "header", "half", "page"])
def test_a_damaged_file_is_refused_and_left_alone(tmp_path, damage):
    path = tmp_path / "a.sqlite"
    filled(path, 40)
    content = bytearray(path.read_bytes())
    assert len(content) > 20_000
    if damage == "text":
        content = bytearray(b"key,experiment\n" * 50)
    elif damage == "header":
        content[:16] = bytes(16)
    elif damage == "half":
        content = content[: len(content) // 2]
    else:
        content[8192 : 8192 + 4096] = b"\xff" * 4096
    path.write_bytes(content)
    with pytest.raises(StoreError, match="damaged"):
        TrialStore(path)
    assert path.read_bytes() == content


def test_a_missing_store_is_not_made_for_reading(tmp_path):
    with pytest.raises(InvalidArgumentError, match="store: expected an existing file"):
        TrialStore(tmp_path / "no.sqlite", create=False)
    assert not list(tmp_path.iterdir())
    with pytest.raises(OutputError, match=r"nowhere/a\.sqlite: cannot be opened or made there"):
        TrialStore(tmp_path / "nowhere" / "a.sqlite")


def test_a_full_disk_keeps_what_was_finished(tmp_path):
    path = tmp_path / "a.sqlite"
    filled(path)
    with TrialStore(path) as store:
        pages = store._db.execute("PRAGMA page_count").fetchone()[0]
        store._db.execute(f"PRAGMA max_page_count = {pages}")  # SQLite's own SQLITE_FULL
        trial = tiny_trials(4)[3]
        with pytest.raises(OutputError, match="the disk is full; finished trials are kept"):
            store.add(trial, outcome(message="x" * 100_000))
        assert len(store) == 3
    with TrialStore(path) as store:
        assert len(store) == 3
        store.add(trial, outcome())
        assert len(store) == 4


@contextmanager
def without_root():
    """File permissions bind root too."""
    if os.getuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.mark.parametrize("what", ["file", "folder"])
def test_a_read_only_store_is_refused_before_any_trial(what):
    with tempfile.TemporaryDirectory() as folder:  # pytest's own are closed to other users
        path = Path(folder) / "a.sqlite"
        filled(path)
        path.chmod(0o444)
        Path(folder).chmod(0o777 if what == "file" else 0o555)
        before = path.read_bytes()
        with without_root(), pytest.raises(OutputError, match=r"read-only|cannot be opened"):
            TrialStore(path if what == "file" else path.with_name("b.sqlite"))
        assert path.read_bytes() == before
        Path(folder).chmod(0o755)


# --- a search killed at any moment; two at once ----------------------------------------------


# --- export ----------------------------------------------------------------------------------


def test_export(tmp_path):
    filled(tmp_path / "a.sqlite")
    with TrialStore(tmp_path / "a.sqlite") as store:
        columns = table(store)
        write_csv(store, tmp_path / "a.csv")
        write_parquet(store, tmp_path / "a.parquet")
        assert len(store) == 3
    errors = columns["metrics/quadratic/orbit_error"]
    assert sorted(errors) == [0.0, 0.1, 0.2]
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["metrics/quadratic/orbit_error"]) for row in rows] == errors
    assert {row["config.teaching.noise"] for row in rows} == {"0.2"}
    assert rows[0]["metrics/quadratic/windows"] == "[1.0, null]"
    parquet = pytest.importorskip("pyarrow.parquet")
    read = parquet.read_table(tmp_path / "a.parquet").to_pydict()
    assert read == columns
