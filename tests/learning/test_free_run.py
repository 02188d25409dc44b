"""Long runs: resumed bit for bit, checkpoints that are refused, errors in windows."""

import dataclasses

import numpy as np
import pytest

from mcmj import Teaching
from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.learning import free_run
from mcmj.learning.practice import Practice
from mcmj.metrics.orbits import orbit_error
from mcmj.simulation import simulation
from mcmj.targets.limit_cycles import target
from mcmj.utils.checkpoint import Checkpoint
from mcmj.utils.errors import CheckpointError, InvalidArgumentError

CONFIG = limit_cycle.Config(
    task="quadratic",
    seed=3,
    free_run=30.0,
    window=12.0,
    timestep=2e-3,
    settings=BodySettings(nodes=12),
    teaching=Teaching(duration=30.0, washout=10.0),
    practice=Practice(rounds=0, trial=12.0, trial_window=10.0),
)
TRIALS = 4  # from rest, after each of two outputs was held, after a push


class StopError(Exception):
    pass


def stop_after(parts):
    """A progress callback that interrupts the run after some parts."""
    left = [parts]

    def on_steps(steps):
        left[0] -= 1
        if left[0] < 0:
            raise StopError

    return on_steps


@pytest.fixture
def small_chunks(monkeypatch):
    """Simulation.stream's default chunk as short as the test's runs need."""
    defaults = simulation.Simulation.stream.__kwdefaults__
    monkeypatch.setitem(defaults, "chunk", 1000)


@pytest.mark.parametrize("parts", [3, 6, 9])
def test_an_interrupted_run_goes_on_bit_for_bit(small_chunks, tmp_path, parts):
    found = limit_cycle.get_body(CONFIG)
    kept = limit_cycle.checkpoints(CONFIG, tmp_path, found)
    whole = limit_cycle.run_tasks(CONFIG, found)["quadratic"]
    with pytest.raises(StopError):
        limit_cycle.run_tasks(CONFIG, found, kept, on_steps=stop_after(TRIALS - 1 + parts))
    assert len(list(tmp_path.iterdir())) == 2
    counted = []
    again = limit_cycle.run_tasks(CONFIG, found, kept, on_steps=counted.append)["quadratic"]
    for name in ("times", "outputs", "positions", "w_out"):
        assert np.array_equal(getattr(again, name), getattr(whole, name)), name
    assert dataclasses.replace(again.fit, w_out=None) == dataclasses.replace(whole.fit, w_out=None)
    assert again.errors == whole.errors
    assert sum(counted) == 54_000
    assert counted[0] >= 39_000 + 1000 * (parts - 1)  # nothing taught or run twice
    for checkpoint in kept.values():
        checkpoint.remove()
    assert not list(tmp_path.iterdir())


OUTPUTS = np.arange(12.0).reshape(6, 2)


def checkpoint_in(folder, rows=6, seed=1):
    """A checkpoint of two saves, as a process that goes on from it would open it."""
    kept = Checkpoint(folder / "run", {"seed": seed}, 2)
    kept.save({"x": np.ones(3)}, OUTPUTS[:3])
    kept.save({"x": np.zeros(3)}, OUTPUTS[3:rows])
    return Checkpoint(folder / "run", {"seed": seed}, 2)


def test_a_checkpoint_gives_back_what_was_saved_last(tmp_path):
    kept = checkpoint_in(tmp_path, rows=5)
    with (tmp_path / "run.outputs").open("ab") as file:
        file.write(b"half")  # interrupted while writing: the rows before count
    arrays, found = kept.load()
    assert np.array_equal(found, OUTPUTS[:5])
    assert list(arrays) == ["x"]
    assert not arrays["x"].any()
    kept.save({"x": np.ones(3)}, OUTPUTS[5:])
    assert np.array_equal(Checkpoint(tmp_path / "run", {"seed": 1}, 2).load()[1], OUTPUTS)


def test_a_checkpoint_of_something_else_is_not_used(tmp_path):
    checkpoint_in(tmp_path)
    assert Checkpoint(tmp_path / "other", {"seed": 1}, 2).load() is None
    other = Checkpoint(tmp_path / "run", {"seed": 2}, 2)
    assert other.load() is None
    other.save({}, OUTPUTS[:1])
    assert np.array_equal(Checkpoint(tmp_path / "run", {"seed": 2}, 2).load()[1], OUTPUTS[:1])


def test_a_run_that_is_killed_over_anothers_checkpoint_leaves_none(tmp_path, monkeypatch):
    kept = checkpoint_in(tmp_path)
    other = Checkpoint(tmp_path / "run", {"seed": 2}, 2)

    def die(*_, **__):
        raise StopError  # the outputs are written, the rest not yet

    monkeypatch.setattr(np, "savez", die)
    with pytest.raises(StopError):
        other.save({}, OUTPUTS[:1])
    assert kept.load() is None


@pytest.mark.parametrize(("suffix", "stride"), [("npz", 11), ("outputs", 1)])
def test_a_damaged_byte_of_a_checkpoint_is_noticed(tmp_path, suffix, stride):
    kept = checkpoint_in(tmp_path)
    arrays, _ = kept.load()
    path = tmp_path / f"run.{suffix}"
    whole, refused = path.read_bytes(), []
    places = range(0, len(whole), stride)
    for k in places:
        path.write_bytes(whole[:k] + bytes([whole[k] ^ 0xFF]) + whole[k + 1 :])
        try:
            found = kept.load()
        except CheckpointError as error:
            refused.append(str(error))
        else:  # times and the like, in the frame of the ZIP file
            assert np.array_equal(found[0]["x"], arrays["x"])
            assert np.array_equal(found[1], OUTPUTS)
    assert len(refused) > 0.7 * len(places)
    assert all("\n" not in text and text.endswith(": delete it to start anew") for text in refused)
    if suffix == "outputs":
        assert len(refused) == len(places)


@pytest.mark.parametrize("suffix", ["npz", "outputs"])
@pytest.mark.parametrize("size", [None, 0, 1, -1])
def test_a_checkpoint_with_something_missing_is_refused(tmp_path, suffix, size):
    kept = checkpoint_in(tmp_path)
    path = tmp_path / f"run.{suffix}"
    content = path.read_bytes()
    path.unlink()
    if size is not None:
        path.write_bytes(content[:size])
    elif suffix == "npz":
        assert kept.load() is None  # killed before the first one was whole
        return
    with pytest.raises(CheckpointError, match="is damaged"):
        kept.load()


def test_outputs_that_are_gone_are_never_filled_with_zeros(tmp_path):
    kept = checkpoint_in(tmp_path)
    kept.load()
    path = tmp_path / "run.outputs"
    path.write_bytes(path.read_bytes()[:-16])  # by something else, while the run is at work
    with pytest.raises(CheckpointError, match="outputs are missing"):
        kept.save({}, OUTPUTS[:1])
    assert path.stat().st_size == OUTPUTS.nbytes - 16


def test_a_run_does_not_go_on_from_a_damaged_checkpoint(small_chunks, tmp_path):
    found = limit_cycle.get_body(CONFIG)
    kept = limit_cycle.checkpoints(CONFIG, tmp_path, found)
    with pytest.raises(StopError):
        limit_cycle.run_tasks(CONFIG, found, kept, on_steps=stop_after(TRIALS + 3))
    (path,) = tmp_path.glob(".checkpoint-*.outputs")
    damaged = bytearray(path.read_bytes())
    damaged[100] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(CheckpointError, match="SHA-256"):
        limit_cycle.run_tasks(CONFIG, found, kept)


def test_a_free_run_needs_the_checkpoint_of_what_is_done(tmp_path, body, w_out):
    moving = simulation.Simulation(body, w_out=w_out)
    with pytest.raises(InvalidArgumentError, match="checkpoint: expected one that holds 6 rows"):
        free_run.free_run(moving, 10, done=OUTPUTS, checkpoint=Checkpoint(tmp_path / "run", {}, 2))


def test_windows_of_a_drifting_orbit():
    """A clock that runs 0.1 % faster every window, and an amplitude that grows by 1 % a window."""
    goal, step, length = target("lissajous"), 5e-3, 40.0
    rows = round(length / step)
    phase, parts = 0.0, []
    for k in range(4):
        speed = 1 + 1e-3 * k
        times = phase + speed * step * np.arange(rows)
        parts.append((1 + 0.01 * k) * goal.sample(times))
        phase = times[-1] + speed * step
    outputs = np.concatenate([*parts, parts[0][:100]])  # a rest that is no whole window
    table = free_run.window_errors(outputs, step, goal, length=length)
    speeds = 1 + 1e-3 * np.arange(4)
    np.testing.assert_allclose(table["periods"], goal.period / speeds, rtol=2e-6)
    assert table["period_drift"] == pytest.approx(1 / speeds[3] - 1 / speeds[1], rel=5e-3)
    assert table["orbit_errors"] == [orbit_error(part, goal) for part in parts]
    expected = table["orbit_errors"][3] / table["orbit_errors"][1]
    assert table["orbit_error_ratio"] == expected > 2
    assert free_run.window_errors(outputs[:100], step, goal, length=length) == {}
    with pytest.raises(InvalidArgumentError, match="length"):
        free_run.window_errors(outputs, step, goal, length=1.0)


def test_a_rhythm_that_dies_is_reported_not_raised():
    goal = target("quadratic")
    alive = goal.sample(0.01 * np.arange(2000))
    windows = free_run.window_errors(
        np.vstack([alive, 0 * alive, 0 * alive]), 0.01, goal, length=20
    )
    assert windows["periods"][0] == pytest.approx(goal.period, rel=1e-6)
    assert np.isnan(windows["periods"][1:]).all()
    assert windows["orbit_errors"][1] > 0.5
