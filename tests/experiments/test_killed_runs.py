"""One run a folder; runs that are killed at any moment go on to the bit."""

import errno
import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from commands import run, start

from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.utils import files
from mcmj.utils.errors import OutputError
from mcmj.utils.files import only_run

SHORT = ["--task", "quadratic", "--seed", "3", "--nodes", "12", "--duration", "30", "--washout"]
SHORT += ["10", "--window", "12", "--no-measure-cost", "--no-video", "--quiet"]
SHORT += ["--rest-runs", "0", "--held-runs", "0", "--rounds", "0"]
BUSY = "another run is at work in the output folder"


def refusals(folder):
    """What becomes of another run in the same process, in a thread of its own."""
    found = []

    def attempt():
        try:
            limit_cycle.run(limit_cycle.Config(task="quadratic"), folder=folder)
        except OutputError as error:
            found.append(str(error))

    thread = threading.Thread(target=attempt)
    thread.start()
    thread.join()
    return found


def test_a_second_run_in_a_folder_is_refused_at_once(tmp_path):
    with only_run(tmp_path), only_run(str(tmp_path)):  # a command and what it calls are one
        assert BUSY in refusals(tmp_path)[0]
        status, out, err = run("limit_cycle", *SHORT, "--out", tmp_path)
        assert status == 1
        assert err.startswith(f"limit_cycle: error: {BUSY}")
        assert err.count("\n") == 1
        assert not out
        with only_run(tmp_path / ".."):
            pass
    assert not list(tmp_path.iterdir())
    with only_run(tmp_path):
        pass


def test_no_lock_without_a_folder(tmp_path):
    with pytest.raises(OutputError, match="cannot open"), only_run(tmp_path / "nowhere"):
        pass


@pytest.mark.parametrize("missing", ["fcntl", "flock"])
def test_where_there_are_no_locks_runs_go_on(tmp_path, monkeypatch, missing):
    def fail(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    if missing == "fcntl":
        monkeypatch.setattr(files, "fcntl", None)
    else:
        monkeypatch.setattr(files.fcntl, "flock", fail)
    with only_run(tmp_path):
        pass


def test_a_killed_run_leaves_no_lock(tmp_path):
    code = "import sys; from mcmj.utils.files import only_run\n"
    code += "with only_run(sys.argv[1]):\n    print(1, flush=True)\n    sys.stdin.read()"
    command = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        with pytest.raises(OutputError, match=BUSY), only_run(tmp_path):
            pass
        process.kill()
    with only_run(tmp_path):
        pass


def rows_kept(folder):
    """Rows of outputs that the checkpoint in a folder has."""
    try:
        with np.load(folder / ".checkpoint-quadratic.npz") as kept:
            return int(kept["steps"])
    except FileNotFoundError:
        return 0


def until(rows, folder, *processes):
    """Wait for a checkpoint of so many rows, made by one of the processes."""
    end = time.monotonic() + 300
    while rows_kept(folder) < rows:
        assert any(process.poll() is None for process in processes)
        assert time.monotonic() < end
        time.sleep(0.01)


def kill(*processes):
    for process in processes:
        process.kill()
        process.communicate()


def assert_same_results(folder, other):
    """To the bit, and nothing else is left."""
    names = {path.name for path in folder.iterdir()}
    assert names == {"body.xml", "limit_cycle.png", "metrics.json", "trajectory.npz"}
    with np.load(folder / "trajectory.npz") as one, np.load(other / "trajectory.npz") as two:
        assert one["quadratic/outputs"].tobytes() == two["quadratic/outputs"].tobytes()
    assert (folder / "body.xml").read_text() == (other / "body.xml").read_text()
    one, two = (json.loads((at / "metrics.json").read_text()) for at in (folder, other))
    assert one == two


@pytest.mark.slow
def test_two_runs_at_once_both_killed_go_on_to_the_right_results(tmp_path):
    whole, folder = tmp_path / "whole", tmp_path / "killed"
    options = [*SHORT, "--free-run", "200"]
    assert run("limit_cycle", *options, "--out", whole)[0] == 0
    both = [start("limit_cycle", *options, "--out", folder) for _ in range(2)]
    until(16384, folder, *both)
    kill(*both)
    errors = sorted(process.returncode for process in both)
    assert errors in ([-signal.SIGKILL, 1], [-signal.SIGKILL] * 2)  # refused, or not yet there
    first = start("limit_cycle", *options, "--out", folder)
    until(32768, folder, first)
    os.kill(first.pid, signal.SIGSTOP)
    status, _, err = run("limit_cycle", *options, "--out", folder)
    assert status == 1
    assert BUSY in err
    kill(first)
    status, _, err = run("limit_cycle", *options, "--out", folder)
    assert status == 0, err
    assert_same_results(folder, whole)


@pytest.mark.slow
def test_a_million_steps_killed_five_times_are_the_same_bits(tmp_path):
    whole, folder = tmp_path / "whole", tmp_path / "killed"
    options = [*SHORT, "--free-run", "1000"]
    assert run("limit_cycle", *options, "--out", whole)[0] == 0
    draw = np.random.default_rng(0)
    kept = 0
    for k in range(1, 6):
        process = start("limit_cycle", *options, "--out", folder)
        until(k * 150_000, folder, process)
        time.sleep(draw.uniform(0.0, 0.2))  # at any moment of a chunk or a save
        kill(process)
        assert process.returncode == -signal.SIGKILL
        assert rows_kept(folder) > kept
        kept = rows_kept(folder)
    status, _, err = run("limit_cycle", *options, "--out", folder)
    assert status == 0, err
    assert_same_results(folder, whole)
