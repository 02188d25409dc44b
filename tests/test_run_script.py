"""scripts/run.sh: what it installs and when, with a Python that only writes down what is asked."""

import os
import shutil
import stat
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from mcmj.experiments.registry import entries

ROOT = Path(__file__).parent.parent
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
# asked for its version it says 3.11; an installation is written down, and fails if told so
STUB = """#!/bin/sh
case "$*" in
    -ISc*) echo 3.11 ;;
    *show_pip.py*) [ ! -e {place}/broken ] && echo "$@" >>{place}/installed ;;
    "-m pip --version") ;;
    *) echo "ran $*" ;;
esac
"""
# in place of the interpreter that runs pip: no test may reach a real one
PIP = """#!/bin/sh
cat <<'END'
Collecting numpy<3
  Downloading numpy-2.4.6-cp311-linux.whl.metadata (6 kB)
  Downloading numpy-2.4.6-cp311-linux.whl (16.6 MB)
  Using cached rich-15.0.0-py3-none-any.whl (310 kB)
Installing collected packages: numpy, rich
END
echo "$@" >&2
exit {status}
"""


@pytest.fixture
def place(tmp_path):
    """A clone with such a .venv, made by the user, and rendering that works."""
    for name in ("scripts/run.sh", "pyproject.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in ("limit_cycle", "emulate", "adopt"):
        folder = f"mcmj/experiments/{name}"
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / ".mcmj").mkdir()
    (tmp_path / ".venv" / ".mcmj" / "gl").write_text("egl\n")
    python = tmp_path / ".venv" / "bin" / "python"
    python.write_text(STUB.format(place=tmp_path))
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    return tmp_path


def run(place, *command):
    return subprocess.run(
        ["sh", place / "scripts" / "run.sh", *command], capture_output=True, text=True,
        env=os.environ | {"PYTHON": "/none"},
    )  # fmt: skip


def installed(place):
    """The requirements of every installation so far."""
    file = place / "installed"
    lines = file.read_text().splitlines() if file.exists() else []
    return [line.partition(" -e ")[2] for line in lines]


def test_each_command_installs_what_it_needs_once(place):
    steps = [
        ("limit_cycle", ". mujoco<4"),
        ("emulate", ".[theory] mujoco<4"),
        ("limit_cycle", None),
        ("emulate", None),
        ("test", ".[theory,dev] mujoco<4"),
        ("adopt", None),  # dev has all
        ("emulate", None),
    ]
    expected = []
    for command, added in steps:
        done = run(place, command, "--flag")
        assert done.returncode == 0, done.stderr
        wanted = "pytest -n logical --maxprocesses 4" if command == "test" else f"mcmj {command}"
        assert done.stdout == f"ran -m {wanted} --flag\n"
        expected += [added] if added else []
        assert installed(place) == expected


def test_other_dependencies_are_installed_with_the_extras_of_before(place):
    run(place, "emulate")
    with (place / "pyproject.toml").open("a") as file:
        file.write("# other\n")
    run(place, "limit_cycle")
    assert installed(place) == [".[theory] mujoco<4"] * 2


def test_an_installation_that_failed_is_tried_again(place):
    (place / "broken").touch()
    done = run(place, "limit_cycle")
    assert done.returncode == 1
    assert "run this again to retry" in done.stderr
    assert not done.stdout
    (place / "broken").unlink()
    assert run(place, "limit_cycle").returncode == 0
    assert len(installed(place)) == 1


def test_a_stamp_of_before_there_were_extras_is_none(place):
    stamp = place / ".venv" / ".mcmj" / "stamp"
    stamp.write_text(f"3.11 {place} 123 456\n")
    run(place, "limit_cycle")
    assert installed(place) == [". mujoco<4"]


def test_an_unknown_command_installs_no_extra(place):
    done = run(place, "limit_cycel")
    assert done.returncode == 2
    assert "no such command: limit_cycel" in done.stderr
    assert installed(place) == [". mujoco<4"]


def test_experiments_name_extras_that_are_there():
    found = {
        name: getattr(import_module(f"mcmj.experiments.{name}"), "EXTRA", None)
        for name in entries()
    }
    assert {extra for extra in found.values() if extra} <= set(EXTRAS)
    assert found["limit_cycle"] is None


@pytest.mark.parametrize("status", [0, 1])
def test_pip_is_shown(status, tmp_path, monkeypatch, capfd):
    python = tmp_path / "python"
    python.write_text(PIP.format(status=status))
    python.chmod(0o755)
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    show_pip = import_module("show_pip")
    monkeypatch.setattr(sys, "executable", str(python))
    monkeypatch.setattr(sys, "argv", ["show_pip.py", "-e", "."])
    assert show_pip.main() == status
    out, err = capfd.readouterr()
    assert err.endswith("--progress-bar=off -e .\n")
    last = "mcmj: installed 2 packages (17 MB to fetch) in 0 s"
    assert out.splitlines()[-1] == (
        "Installing collected packages: numpy, rich" if status else last
    )
