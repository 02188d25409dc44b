"""Long runs: resumed bit for bit, checkpoints that are refused, errors in windows."""

import dataclasses

import numpy as np
import pytest

from mcmj import Teaching
from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.learning import free_run
from mcmj.metrics.orbits import orbit_error
from mcmj.simulation import simulation
from mcmj.targets.limit_cycles import target
from mcmj.utils.checkpoint import Checkpoint
from mcmj.utils.errors import InvalidArgumentError

CONFIG = limit_cycle.Config(
    task="quadratic",
    seed=3,
    free_run=30.0,
    window=12.0,
    timestep=2e-3,
    settings=BodySettings(nodes=12),
    teaching=Teaching(duration=30.0, washout=10.0),
)


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
        limit_cycle.run_tasks(CONFIG, found, kept, on_steps=stop_after(parts))
    assert len(list(tmp_path.iterdir())) == 2
    counted = []
    again = limit_cycle.run_tasks(CONFIG, found, kept, on_steps=counted.append)["quadratic"]
    for name in ("times", "outputs", "positions", "w_out"):
        assert np.array_equal(getattr(again, name), getattr(whole, name)), name
    assert dataclasses.replace(again.fit, w_out=None) == dataclasses.replace(whole.fit, w_out=None)
    assert again.errors == whole.errors
    assert sum(counted) == 30_000
    assert counted[0] >= 15_000 + 1000 * (parts - 1)  # nothing taught or run twice
    for checkpoint in kept.values():
        checkpoint.remove()
    assert not list(tmp_path.iterdir())


def test_a_checkpoint_of_something_else_or_a_damaged_one_is_not_used(tmp_path):
    stem = tmp_path / "run"
    outputs = np.arange(10.0).reshape(5, 2)
    Checkpoint(stem, {"seed": 1}, 2).save({"x": np.ones(3)}, outputs[:3], 0)
    Checkpoint(stem, {"seed": 1}, 2).save({"x": np.zeros(3)}, outputs[3:], 3)
    arrays, found = Checkpoint(stem, {"seed": 1}, 2).load()
    assert np.array_equal(found, outputs)
    assert not arrays["x"].any()
    assert Checkpoint(stem, {"seed": 2}, 2).load() is None
    assert Checkpoint(tmp_path / "other", {"seed": 1}, 2).load() is None
    with (tmp_path / "run.outputs").open("ab") as file:
        file.write(b"half")  # interrupted while writing: the rows before count
    assert np.array_equal(Checkpoint(stem, {"seed": 1}, 2).load()[1], outputs)
    Checkpoint(stem, {"seed": 1}, 2).save({"x": np.zeros(3)}, outputs[:1], 5)
    assert np.array_equal(Checkpoint(stem, {"seed": 1}, 2).load()[1][5:], outputs[:1])
    (tmp_path / "run.npz").write_bytes(b"rubbish")
    assert Checkpoint(stem, {"seed": 1}, 2).load() is None


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
