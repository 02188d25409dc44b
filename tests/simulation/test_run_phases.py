"""Schedules: every kind of phase against a plain rollout, the NumPy twin, or statistics."""

from dataclasses import replace

import numpy as np
import pytest
import twins
from models import CHAIN, CHAIN_PARTS

import mcmj
from mcmj import Reservoir, Simulation
from mcmj.simulation import run_phases
from mcmj.simulation.run_phases import Phase, RandomForces, Schedule, run_schedule
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import stream

STEP = 1e-3


@pytest.fixture
def w_out(w_out):
    """Gentle: the body stays bounded at this step."""
    return 0.05 * w_out


@pytest.fixture
def w_bias(w_out):
    return np.vstack([w_out, [[0.07, -0.04]]])


def moving(body, w_out, **options):
    """A body in motion, its loop closed."""
    simulation = Simulation(body, w_out=w_out, timestep=STEP, **options)
    simulation.set_state(velocities=0.2 * np.random.default_rng(3).normal(size=(body.n_nodes, 2)))
    return simulation


def run(body, w_out, *phases, seed=0, record=("lengths",), **options):
    return run_schedule(moving(body, w_out, **options), Schedule(phases), seed, record=record)


def test_free_phases_are_one_rollout(body, w_out):
    result = run(body, w_out, Phase(0.15), Phase(0.25))
    plain = moving(body, w_out).rollout(400)
    assert np.array_equal(result.trajectory.lengths, plain.lengths)
    assert np.array_equal(result.trajectory.times, plain.times)
    assert result.boundaries == (0, 150, 400)
    assert result.phase(1) == result.phase(-1) == slice(150, 400)
    assert np.array_equal(result.feedback, result.trajectory.outputs)


@pytest.mark.parametrize("readout", ["w_out", "w_bias"])
def test_a_frozen_output_is_constant_and_what_the_twin_does_with_it(body, readout, request):
    weights = request.getfixturevalue(readout)
    euler = {"integrator": "Euler"}
    result = run(body, weights, Phase(0.2), Phase(0.2, freeze=(0,)), Phase(0.1), **euler)
    held = result.feedback[200:400]
    assert np.ptp(held[:, 0]) == 0.0
    assert np.ptp(held[:, 1]) > 1e-6
    first = result.feedback[199]
    assert held[0, 0] == first[0]  # no jump as the phase begins
    before = moving(body, weights, **euler)
    before.rollout(200)
    state = before.state
    offset = np.tile([first[0], 0.0], (200, 1))
    twin = twins.run(
        body, 200, timestep=STEP, w_out=weights, offset=offset, gate=np.array([0.0, 1.0]),
        positions=state.positions, velocities=state.velocities,
    )  # fmt: skip
    np.testing.assert_allclose(result.trajectory.lengths[200:400], twin.lengths, atol=1e-10)
    assert np.array_equal(result.feedback[400:], result.trajectory.outputs[400:])


def test_constant_and_random_forces_are_rollout_forces(body, w_out):
    given = np.linspace(-3, 3, body.n_nodes)
    result = run(body, w_out, Phase(0.1, forces=given), Phase(0.1, forces=RandomForces(5.0)),
                 Phase(0.1, forces=RandomForces(5.0)), Phase(0.1), seed=7)  # fmt: skip
    rng = stream(7, "schedule_forces")
    plain = moving(body, w_out)
    forces = (given, *(rng.uniform(-5, 5, body.n_nodes) for _ in range(2)), None)
    lengths = [plain.rollout(100, forces=f).lengths for f in forces]
    assert np.array_equal(result.trajectory.lengths, np.concatenate(lengths))


def test_length_noise_has_its_statistics_and_is_what_the_readout_would_see(body, w_bias):
    std = 0.02
    result = run(body, w_bias, Phase(15, length_noise=std), seed=1)
    added = result.feedback - result.trajectory.outputs
    weights = w_bias[: body.n_springs]
    expected = std**2 * weights.T @ weights
    scale = np.sqrt(np.outer(*2 * [np.diag(expected)]) / len(added))
    assert np.abs((np.cov(added.T) - expected) / scale).max() < 6
    assert np.abs(added.mean(axis=0) / np.sqrt(np.diag(expected) / len(added))).max() < 5
    assert abs(np.corrcoef(added[1:, 0], added[:-1, 0])[0, 1]) < 5 / np.sqrt(len(added))
    noise = std * stream(1, "schedule_noise").standard_normal((len(added), body.n_springs))
    seen = (result.trajectory.lengths + noise) @ weights + w_bias[-1]
    np.testing.assert_allclose(result.feedback, seen, rtol=0, atol=1e-9)
    plain = moving(body, w_bias).rollout(offset=noise @ weights)
    np.testing.assert_allclose(result.trajectory.lengths, plain.lengths, atol=1e-8)


def test_a_frozen_channel_gets_no_noise(body, w_out):
    result = run(body, w_out, Phase(0.1, length_noise=1.0, freeze=(1,)))
    assert np.ptp(result.feedback[:, 1]) == 0.0
    assert np.ptp(result.feedback[:, 0]) > 0.01


def test_same_seed_same_bits_and_no_dependence_on_the_chunk(body, w_out, monkeypatch):
    phases = (Phase(0.15, length_noise=0.1), Phase(0.15, forces=RandomForces(2.0)), Phase(0.1))
    first, again = (run(body, w_out, *phases, seed=5) for _ in range(2))
    monkeypatch.setattr(run_phases, "CHUNK", 37)
    chunks = run(body, w_out, *phases, seed=5)
    other = run(body, w_out, *phases, seed=6)
    for result in (again, chunks):
        assert np.array_equal(result.trajectory.lengths, first.trajectory.lengths)
    assert not np.array_equal(other.trajectory.lengths, first.trajectory.lengths)


def test_readout_switch_gate_and_offset(body, w_out):
    result = run(body, w_out, Phase(0.1), Phase(0.1, w_out=-w_out), Phase(0.1, gate=0.0),
                 Phase(0.1, gate=(0.5, 1.0), offset=(0.1, -0.2)))  # fmt: skip
    plain, lengths = moving(body, w_out), []
    lengths.append(plain.rollout(100).lengths)
    plain.set_readout(-w_out)
    lengths.append(plain.rollout(100).lengths)
    lengths.append(plain.rollout(100, gate=0.0).lengths)
    offset = np.tile([0.1, -0.2], (100, 1))
    lengths.append(plain.rollout(100, gate=[0.5, 1.0], offset=offset).lengths)
    assert np.array_equal(result.trajectory.lengths, np.concatenate(lengths))
    assert not result.feedback[200:300].any()


@pytest.mark.parametrize("springs", ["native", "cubic"])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_cut_springs_and_changed_masses_are_the_twins(body, w_out, springs, integrator):
    masses = body.masses * np.linspace(0.5, 3.0, body.n_nodes)
    damage = Phase(0.15, cut=(0, 4), masses=masses)
    result = run(body, w_out, Phase(0.1), damage, springs=springs, integrator=integrator)
    before = moving(body, w_out, springs=springs, integrator=integrator)
    before.rollout(100)
    state = before.state

    def pull(x1, x2, b):
        force = twins.cubic(x1, x2, b)
        force[[0, 4]] = 0.0
        return force

    twin = twins.run(
        replace(body, masses=masses), 150, timestep=STEP, w_out=w_out, integrator=integrator,
        positions=state.positions, velocities=state.velocities, pull=pull,
    )  # fmt: skip
    np.testing.assert_allclose(result.trajectory.lengths[100:], twin.lengths, atol=1e-10)
    whole = moving(body, w_out).rollout(250).lengths
    assert np.abs(result.trajectory.lengths[100:] - whole[100:]).max() > 1e-4


def test_a_channel_frozen_again_stays_where_it_is(body, w_out):
    result = run(body, w_out, Phase(0.1), Phase(0.1, freeze=(0,)), Phase(0.1, freeze=(0, 1)))
    assert np.ptp(result.feedback[99:, 0]) == 0.0
    assert np.ptp(result.feedback[199:, 1]) == 0.0


def test_a_schedule_that_begins_frozen_holds_the_output_of_that_moment(body, w_out):
    result = run(body, w_out, Phase(0.1, freeze=(0,)))
    np.testing.assert_allclose(result.feedback[0, 0], result.trajectory.outputs[0, 0], rtol=1e-12)


def test_the_twin_engine_says_that_bodies_do_not_change(body, w_out):
    simulation = Simulation(body, w_out=w_out, engine="twin")
    with pytest.raises(InvalidArgumentError, match="'mujoco' for bodies that change"):
        run_schedule(simulation, Schedule([Phase(0.05), Phase(0.05, cut=(0,))]), 0)
    assert simulation.time == 0.0


def test_without_a_readout_phases_are_open_loop(body):
    simulation = Simulation(body)
    result = run_schedule(simulation, Schedule([Phase(0.05, freeze=(0,), offset=(0.0, 1.0))]), 0)
    assert np.array_equal(result.feedback, np.tile([0.0, 1.0], (50, 1)))


@pytest.mark.parametrize(
    "wrong",
    [
        {"duration": 0.0},
        {"length_noise": -1.0},
        {"freeze": (-1,)},
        {"freeze": 0},
        {"cut": (0.5,)},
        {"forces": [np.nan]},
        {"offset": "high"},
        {"w_out": [1.0]},
        {"gate": [np.inf]},
    ],
)
def test_a_wrong_phase_is_refused_as_it_is_made(wrong):
    with pytest.raises(InvalidArgumentError):
        Phase(**{"duration": 1.0} | wrong)


@pytest.mark.parametrize("phases", [[], [1.0], [Phase(0.5), None]])
def test_a_schedule_holds_phases(phases):
    with pytest.raises(InvalidArgumentError, match="phases"):
        Schedule(phases)
    with pytest.raises(InvalidArgumentError, match="scale"):
        RandomForces(0.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"freeze": (2,)},
        {"freeze": (1,), "offset": [0.0, 1.0]},
        {"cut": (999,)},
        {"forces": [1.0]},
        {"masses": np.zeros(8)},
        {"offset": [1.0]},
        {"gate": [1.0]},
        {"w_out": np.zeros((3, 2))},
        {"duration": 1e-4},
    ],
)
def test_a_phase_that_does_not_fit_is_refused_before_anything_runs(body, w_out, wrong):
    simulation = moving(body, w_out)
    with pytest.raises(InvalidArgumentError):
        run_schedule(simulation, Schedule([Phase(0.05), Phase(**{"duration": 1.0} | wrong)]), 0)
    assert simulation.time == 0.0


def test_ensembles_are_refused(body, w_out):
    with pytest.raises(InvalidArgumentError, match="one without copies, got 2"):
        run_schedule(mcmj.Ensemble(body, copies=2, w_out=w_out), Schedule([Phase(0.05)]), 0)


def test_phases_of_any_model():
    """Freeze, switch, forces by joint and by body, noise, masses: rollouts with that law."""
    rng = np.random.default_rng(3)
    w_out, other = 0.2 * rng.normal(size=(2, 5, 2))
    model = Reservoir(CHAIN, **CHAIN_PARTS)
    model.set_state(qvel=[1.0, -2.0])
    model.set_readout(w_out)
    start = model.snapshot()
    phases = [
        Phase(0.4, freeze=(1,)),
        Phase(0.4, forces=(0.1, 0.2)),
        Phase(0.4, forces={"b": (0.1, -0.2, 0.0)}, w_out=other),
        Phase(0.4, length_noise=0.1, masses={"b": 0.5}),
    ]
    run = run_schedule(model, Schedule(phases), seed=0, record=("signals", "outputs"))
    assert np.allclose(run.feedback[:200, 1], run.feedback[0, 1], rtol=0, atol=0)

    model = Reservoir(CHAIN, **CHAIN_PARTS)
    model.restore(start)
    model.set_readout(w_out)
    held = (model.signals @ w_out[:4] + w_out[4])[1]
    parts = [
        model.rollout(offset=np.tile([0.0, held], (200, 1)), gate=(1.0, 0.0)),
        model.rollout(200, forces=(0.1, 0.2)),
    ]
    model.set_readout(other)
    parts.append(model.rollout(200, forces={"b": (0.1, -0.2, 0.0)}))
    model.alter(masses={"b": 0.5})
    noise = 0.1 * stream(0, "schedule_noise").standard_normal((200, 4))
    parts.append(model.rollout(offset=noise @ other[:4]))
    signals = np.concatenate([part.signals for part in parts])
    assert np.abs(run.trajectory.signals - signals).max() < 1e-12
    with pytest.raises(UnknownNameError, match="unknown body 'no'"):
        run_schedule(model, Schedule([Phase(1.0, masses={"no": 1.0})]), seed=0)
