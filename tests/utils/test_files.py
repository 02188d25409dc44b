"""Result files: whole or not there, readable without pickle, plain JSON."""

import errno
import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from mcmj.utils.errors import McmjError, OutputError
from mcmj.utils.files import (
    plain,
    prepare_folder,
    versions,
    whole_file,
    write_arrays,
    write_metrics,
    write_text,
)


@dataclass(frozen=True)
class Config:
    size: int = 3
    ranges: tuple = (1.0, 2.0)
    out: Path = Path("somewhere")


def test_whole_file_appears_at_once(tmp_path):
    path = tmp_path / "a.txt"
    with whole_file(path) as temporary:
        temporary.write_text("half")
        assert not path.exists()
        assert temporary.parent == tmp_path  # same disk: the move is atomic
    assert path.read_text() == "half"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, OSError])
@pytest.mark.parametrize("before", [None, "old"])
def test_a_failure_leaves_what_was_there_and_nothing_else(tmp_path, error, before):
    path = tmp_path / "a.txt"
    if before:
        path.write_text(before)

    def fail():
        with whole_file(path) as temporary:
            temporary.write_text("half")
            raise error("no")

    with pytest.raises(OutputError if error is OSError else error):
        fail()
    assert [p.name for p in tmp_path.iterdir()] == (["a.txt"] if before else [])
    if before:
        assert path.read_text() == before


@pytest.mark.parametrize("folder", [False, True])
def test_a_file_is_on_the_disk_before_it_takes_its_name(tmp_path, monkeypatch, folder):
    steps = []
    fsync, replace = os.fsync, os.replace

    def recorded(handle):
        steps.append(os.fstat(handle).st_ino)
        fsync(handle)

    monkeypatch.setattr(os, "fsync", recorded)
    monkeypatch.setattr(os, "replace", lambda a, b: (steps.append("replace"), replace(a, b)))
    final = tmp_path / "a"
    with whole_file(final, folder=folder) as temporary:
        inside = temporary / "b" if folder else temporary
        inside.write_text("text")
    parts = [final / "b", final] if folder else [final]
    inodes = [path.stat().st_ino for path in (*parts, tmp_path)]
    assert steps == [*inodes[:-1], "replace", inodes[-1]]


def test_a_disk_that_fails_late_is_an_output_error(tmp_path, monkeypatch):
    def fail(handle):
        raise OSError(errno.EIO, "Input/output error")

    write_text(tmp_path / "a.txt", "old")
    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OutputError, match=r"a\.txt: Input/output error"):
        write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_second_write_replaces_the_first(tmp_path):
    for text in ("one", "zwölf"):
        write_text(tmp_path / "a.txt", text)
    assert (tmp_path / "a.txt").read_bytes().decode("utf-8") == "zwölf"


@pytest.fixture
def unwritable(tmp_path):
    """A path below a regular file: nobody can write there, root neither."""
    (tmp_path / "file").write_text("")
    return tmp_path / "file" / "below"


WRITERS = {
    "write_text": lambda path: write_text(path, "x"),
    "write_metrics": lambda path: write_metrics(path, "s", {}, 0, {}),
    "write_arrays": lambda path: write_arrays(path, {"a": np.ones(2)}, {}, 0),
    "prepare_folder": prepare_folder,
}


@pytest.mark.parametrize("writer", WRITERS)
def test_what_cannot_be_written_is_an_output_error(unwritable, writer):
    with pytest.raises(OutputError, match="cannot write") as caught:
        WRITERS[writer](unwritable)
    assert str(unwritable) in str(caught.value)
    assert isinstance(caught.value, McmjError | OSError)


@pytest.mark.parametrize("writer", ["write_text", "write_metrics", "write_arrays"])
def test_a_missing_folder_is_an_output_error(tmp_path, writer):
    with pytest.raises(OutputError, match="cannot write"):
        WRITERS[writer](tmp_path / "nowhere" / "file")


@pytest.mark.parametrize("writer", ["write_text", "write_metrics", "write_arrays"])
def test_a_folder_in_the_way_is_an_output_error(tmp_path, writer):
    (tmp_path / "taken").mkdir()
    with pytest.raises(OutputError, match="cannot write"):
        WRITERS[writer](tmp_path / "taken")
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_prepare_folder(tmp_path):
    folder = tmp_path / "a" / "b"
    assert prepare_folder(folder) == folder
    assert prepare_folder(str(folder)) == folder
    assert list(folder.iterdir()) == []


def test_metrics_file(tmp_path):
    path = tmp_path / "metrics.json"
    measured = {"error": np.float64(0.1), "bad": np.nan, "worse": -np.inf, "list": np.arange(3),
                "nested": {"ok": np.True_, "none": None}, 7: "number as a key"}  # fmt: skip
    write_metrics(path, "limit_cycle", Config(), 5, measured)

    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    document = json.loads(path.read_text(), parse_constant=refuse)
    assert list(document) == ["scenario", "config", "seed", "versions", "metrics"]
    assert document["scenario"] == "limit_cycle"
    assert document["config"] == {"size": 3, "ranges": [1.0, 2.0], "out": "somewhere"}
    assert document["seed"] == 5
    assert document["metrics"] == {
        "error": 0.1, "bad": None, "worse": None, "list": [0, 1, 2],
        "nested": {"ok": True, "none": None}, "7": "number as a key",
    }  # fmt: skip
    assert document["versions"] == versions()
    assert document["versions"]["numpy"] == np.__version__


def test_arrays_round_trip_without_pickle(tmp_path):
    path = tmp_path / "trajectory.npz"
    arrays = {
        "lengths": np.random.default_rng(0).normal(size=(5, 3)),
        "nan": np.array([np.nan, -0.0, np.inf]),
        "flags": np.array([True, False]),
        "names": np.array(["a", "bb"]),
        "empty": np.zeros((0, 2)),
    }
    write_arrays(path, arrays, Config(), 4)
    with np.load(path, allow_pickle=False) as stored:
        assert set(stored.files) == {*arrays, "provenance"}
        for name, array in arrays.items():
            assert stored[name].dtype == array.dtype
            assert stored[name].tobytes() == array.tobytes()
            assert stored[name].shape == array.shape
        account = json.loads(str(stored["provenance"]))
    assert account["config"]["size"] == 3
    assert account["seed"] == 4
    assert account["versions"] == versions()


def test_objects_are_not_pickled(tmp_path):
    with pytest.raises((McmjError, ValueError, TypeError)):
        write_arrays(tmp_path / "a.npz", {"a": np.array([None, {}], dtype=object)}, {}, 0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("value", "wanted"),
    [
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (True, True),
        (np.array(2.0), 2.0),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        ((1, (2, 3)), [1, [2, 3]]),
        (Path("a/b"), "a/b"),
        (Config(ranges=()), {"size": 3, "ranges": [], "out": "somewhere"}),
        (float("inf"), None),
    ],
)
def test_plain(value, wanted):
    result = plain(value)
    assert result == wanted
    assert type(result) is type(wanted)
    json.dumps(result, allow_nan=False)
