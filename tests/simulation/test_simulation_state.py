"""What carries over between calls: state, snapshots, resets, chunks."""

from dataclasses import fields

import numpy as np
import pytest
import twins
from rollouts import ALL, VARIANTS, T, assert_same, exact_oscillator, join, part, same_bits

from mcmj import Body, Simulation
from mcmj.simulation.simulation import CHUNK
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjError


@pytest.mark.parametrize("options", VARIANTS)
def test_two_rollouts_equal_one(body, w_bias, drive, options):
    whole = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    simulation = Simulation(body, w_out=w_bias, **options)
    parts = [simulation.rollout(**part(drive, a, b), record=ALL) for a, b in ((0, 113), (113, T))]
    assert same_bits(join(parts), whole, (*ALL, "times"))
    assert np.array_equal(parts[-1].final_state.positions, whole.final_state.positions)
    assert simulation.time == pytest.approx(T * 1e-3, abs=1e-15)


@pytest.mark.parametrize("options", VARIANTS)
def test_snapshot_and_restore(body, w_bias, drive, options):
    simulation = Simulation(body, w_out=w_bias, **options)
    simulation.rollout(**part(drive, 0, 57))
    snapshot = simulation.snapshot()
    first = simulation.rollout(**part(drive, 57, T), record=ALL)
    simulation.restore(snapshot)
    again = simulation.rollout(**part(drive, 57, T), record=ALL)
    assert same_bits(first, again, (*ALL, "times"))
    twin = Simulation(body, w_out=w_bias, **options)
    twin.restore(snapshot)
    assert same_bits(first, twin.rollout(**part(drive, 57, T), record=ALL), (*ALL, "times"))


@pytest.mark.parametrize("engine", ["mujoco", "twin"])
def test_a_snapshot_of_something_else_is_refused(body, engine):
    options = {"engine": engine, "integrator": "Euler"}
    simulation = Simulation(body, **options)
    heavier = {f.name: getattr(body, f.name) for f in fields(body)} | {"masses": 2 * body.masses}
    others = [
        Simulation(Body(**heavier), **options),
        Simulation(body, **options, timestep=2e-3),
        Simulation(body, engine=engine, integrator="RK4"),
    ]
    for other in others:
        assert other.snapshot().shape == simulation.snapshot().shape
        with pytest.raises(InvalidArgumentError, match=r"^snapshot: .*timestep=0\.001"):
            simulation.restore(other.snapshot())
    for wrong in (None, "x", 3.0, [], [[]]):
        with pytest.raises(InvalidArgumentError, match=r"^snapshot: "):
            simulation.restore(wrong)
    simulation.restore(Simulation(Body(**heavier | {"masses": body.masses}), **options).snapshot())


@pytest.mark.parametrize("options", VARIANTS)
def test_reset_is_a_new_start(body, w_bias, drive, options):
    simulation = Simulation(body, w_out=w_bias, **options)
    first = simulation.rollout(**drive, record=ALL)
    simulation.reset()
    assert simulation.time == 0.0
    assert np.array_equal(simulation.state.positions, body.positions)
    assert not simulation.state.velocities.any()
    assert same_bits(first, simulation.rollout(**drive, record=ALL), (*ALL, "times"))


def test_set_state(body):
    rng = np.random.default_rng(0)
    positions = body.positions + rng.normal(size=body.positions.shape)
    velocities = 0.3 * rng.normal(size=body.positions.shape)
    simulation = Simulation(body, integrator="Euler")
    simulation.set_state(positions, velocities)
    start = np.where(body.fixed[:, None], body.positions, positions)
    assert np.abs(simulation.state.positions - start).max() < 1e-13
    assert np.array_equal(simulation.state.velocities[body.free], velocities[body.free])
    assert not simulation.state.velocities[body.fixed].any()
    twin = twins.run(body, 100, positions=start, velocities=velocities)
    assert_same(simulation.rollout(100, record=ALL), twin)


def test_a_thinned_trajectory_is_every_nth_sample(body, w_bias, drive):
    whole = Simulation(body, w_out=w_bias).rollout(**drive, record=ALL)
    thin = whole.thinned(7)
    for name in (*ALL, "times"):
        assert np.array_equal(getattr(thin, name), getattr(whole, name)[::7])
    assert thin.qpos is None


@pytest.mark.parametrize("chunk", [1, 7, 100, T, 10 * T])
@pytest.mark.parametrize("options", [{}, {"substeps": 3, "feedback_delay": 1}])
def test_chunks_equal_one_rollout(body, w_bias, drive, chunk, options):
    whole = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    chunks = list(
        Simulation(body, w_out=w_bias, **options).stream(**drive, record=ALL, chunk=chunk)
    )
    assert [len(c) for c in chunks[:-1]] == [chunk] * (len(chunks) - 1)
    assert same_bits(join(chunks), whole, (*ALL, "times"))


def test_rollout_longer_than_a_chunk(oscillator):
    steps = CHUNK + 10
    run = Simulation(oscillator).rollout(steps, record=("lengths",))
    assert run.lengths.shape == (steps, 1)
    exact = exact_oscillator(oscillator, run.times[::500])[:, 0]
    assert np.abs(run.lengths[::500, 0] - 1.0 - exact).max() < 2e-3


def still(time, lengths):
    return np.zeros(8)


@pytest.mark.parametrize("engine", ["mujoco", "twin"])
@pytest.mark.parametrize("second", ["stream", "rollout"])
def test_a_second_drive_in_mid_stream_is_refused(body, w_bias, engine, second):
    """It would take the first one's gate; the first goes on to the bit."""
    whole = Simulation(body, w_out=w_bias, engine=engine).rollout(40, gate=0.5)
    simulation = Simulation(body, w_out=w_bias, engine=engine)
    stream, parts = simulation.stream(40, gate=0.5, chunk=10), []
    for run in stream:
        parts.append(run.lengths)
        if len(parts) < 4:
            with pytest.raises(McmjError, match="not at its end"):
                list(getattr(simulation, second)(5, gate=0.0))
    assert np.concatenate(parts).tobytes() == whole.lengths.tobytes()
    simulation.rollout(5)


def test_a_drive_inside_a_hook_is_refused(body, w_out):
    simulation = Simulation(body, w_out=w_out)

    def hook(time, lengths):
        simulation.rollout(1, gate=0.0)

    with pytest.raises(McmjError, match="not at its end"):
        simulation.rollout(5, hook=hook)
    assert simulation.rollout(5, hook=still).lengths.shape == (5, body.n_springs)


def test_a_stream_that_is_left_frees_its_simulation(body, w_out):
    simulation = Simulation(body, w_out=w_out)
    for _ in simulation.stream(40, chunk=10):
        break
    stream = simulation.stream(40, chunk=10)
    simulation.rollout(1)  # it has not begun
    next(stream)
    stream.close()
    with pytest.raises(DivergenceError):
        simulation.rollout(2000, forces=np.full(body.n_nodes, 1e30))
    simulation.reset()
    simulation.rollout(1)
