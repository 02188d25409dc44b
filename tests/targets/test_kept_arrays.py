"""Arrays kept on the disk: the same as computed; a damaged or forbidden cache is harmless."""

import os
import sys

import numpy as np
import pytest

from mcmj.targets import kept_arrays as module
from mcmj.targets.gaits import GAITS
from mcmj.targets.kept_arrays import kept_arrays
from mcmj.targets.limit_cycles import quadratic
from mcmj.utils.files import cache_folder

WANTED = {"a": np.arange(6.0).reshape(2, 3), "b 1": np.array(np.pi)}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MCMJ_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


class Compute:
    calls = 0

    def __call__(self):
        self.calls += 1
        return WANTED


def check(found):
    assert found.keys() == WANTED.keys()
    assert all(np.array_equal(found[name], WANTED[name]) for name in WANTED)


def test_computed_once(folder):
    compute = Compute()
    for _ in range(3):
        check(kept_arrays("test", [1, "x"], compute))
    assert compute.calls == 1
    check(kept_arrays("test", [2, "x"], compute))
    assert compute.calls == 2
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "text", "another", "folder"])
def test_a_damaged_file_is_computed_anew(folder, damage):
    compute = Compute()
    kept_arrays("test", 1, compute)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    if damage == "another":  # a whole file under a name that is not its own
        kept_arrays("test", 2, lambda: {"a": np.zeros(1)})
        (other,) = set(folder.iterdir()) - {path}
        path.write_bytes(other.read_bytes())
    elif damage == "folder":
        path.unlink()
        path.mkdir()
    else:
        at = whole.index(WANTED["a"].tobytes())
        flipped = whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
        cut = whole[: len(whole) // 2]
        files = {"empty": b"", "cut": cut, "flipped": flipped, "text": b"no"}
        path.write_bytes(files[damage])
    check(kept_arrays("test", 1, compute))
    assert compute.calls == 2


def test_a_folder_that_cannot_be_made(folder):
    folder.write_text("in the way")
    check(kept_arrays("test", 1, Compute()))
    assert folder.read_text() == "in the way"


def test_the_newest_stay(folder, monkeypatch):
    monkeypatch.setattr(module, "MOST_FILES", 3)
    for k in range(5):
        kept_arrays("test", k, Compute())
        for path in folder.iterdir():  # clocks of file systems are coarse
            os.utime(path, (path.stat().st_mtime - 10,) * 2)
    assert len(list(folder.iterdir())) == 3
    compute = Compute()
    kept_arrays("test", 4, compute)
    assert compute.calls == 0


def test_the_place_is_the_system_s(monkeypatch, tmp_path):
    monkeypatch.delenv("MCMJ_CACHE_DIR")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "mcmj"


@pytest.mark.parametrize("make", [lambda: quadratic(2.5), GAITS["trot"].target])
def test_a_target_that_was_kept_is_the_computed_one_to_the_bit(folder, make):
    fresh = make()
    assert len(list(folder.iterdir())) == 1
    again = make()
    assert again.period == fresh.period
    assert np.array_equal(again.orbit(999), fresh.orbit(999))
