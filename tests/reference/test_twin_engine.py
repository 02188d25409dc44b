"""Simulation(engine="twin") is Simulation in MuJoCo, to rounding."""

import numpy as np
import pytest

import mcmj
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError

STEPS = 1500


@pytest.fixture(scope="module")
def body():
    return mcmj.random_body(6, 14, n_inputs=1)


@pytest.fixture(scope="module")
def w_out(body):
    return 1e-3 * np.random.default_rng(2).standard_normal((body.n_springs + 1, 2))


@pytest.fixture(scope="module")
def drive(body):
    rng = np.random.default_rng(3)
    return {
        "inputs": rng.uniform(-1, 1, (STEPS, 1)),
        "offset": rng.uniform(-0.1, 0.1, (STEPS, 2)),
        "forces": rng.uniform(-1, 1, body.n_nodes),
        "gate": [1.0, 0.5],
    }


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "leapfrog"])
def test_same_trajectory(body, w_out, drive, integrator):
    runs = [
        mcmj.Simulation(body, w_out=w_out, integrator=integrator, engine=engine).rollout(**drive)
        for engine in ("mujoco", "twin")
    ]
    assert np.ptp(runs[0].lengths, axis=0).max() > 0.01
    assert np.abs(runs[0].lengths - runs[1].lengths).max() < 1e-12
    assert np.abs(runs[0].outputs - runs[1].outputs).max() < 1e-13
    ends = [run.final_state.positions for run in runs]
    assert np.abs(ends[0] - ends[1]).max() < 1e-12
    assert runs[1].final_state.time == runs[0].final_state.time


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "leapfrog"])
def test_chunks_and_snapshots_change_no_bit(body, w_out, drive, integrator):
    simulation = mcmj.Simulation(body, w_out=w_out, integrator=integrator, engine="twin")
    whole = simulation.rollout(STEPS, forces=drive["forces"])
    simulation.reset()
    first = simulation.rollout(600, forces=drive["forces"])
    kept = simulation.snapshot()
    rest = [simulation.rollout(900, forces=drive["forces"])]
    simulation.restore(kept)
    rest.append(simulation.rollout(900, forces=drive["forces"]))
    for run in rest:
        assert np.array_equal(np.vstack([first.lengths, run.lengths]), whole.lengths)
        assert run.times[0] == whole.times[600]


def test_ensemble_of_readouts(body, w_out, drive):
    readouts = np.stack([k * w_out for k in range(6)])
    ensemble = mcmj.Ensemble(body, copies=6, threads=2, w_out=readouts, engine="twin")
    together = ensemble.rollout(400, forces=drive["forces"])
    for k in (0, 5):
        alone = mcmj.Simulation(body, w_out=readouts[k]).rollout(400, forces=drive["forces"])
        assert np.abs(together.lengths[k] - alone.lengths).max() < 1e-12


def test_set_state(body):
    simulations = [mcmj.Simulation(body, engine=engine) for engine in ("mujoco", "twin")]
    kick = 0.1 * np.random.default_rng(0).standard_normal((body.n_nodes, 2))
    for simulation in simulations:
        simulation.set_state(velocities=kick)
    states = [simulation.state for simulation in simulations]
    assert np.array_equal(states[0].velocities, states[1].velocities)
    ends = [s.rollout(300).lengths[-1] for s in simulations]
    assert np.abs(ends[0] - ends[1]).max() < 1e-12


def test_teaching_goes_either_way(body):
    goal = mcmj.target("van_der_pol")
    fits = []
    for engine in ("mujoco", "twin"):
        simulation = mcmj.Simulation(body, engine=engine)
        fits.append(mcmj.teach(simulation, goal, mcmj.Teaching(duration=8, washout=2), seed=0))
    assert fits[0].train_nrmse == pytest.approx(fits[1].train_nrmse, rel=1e-6)


def test_what_the_twin_does_not_do_is_named(body):
    for options, text in (
        ({"springs": "cubic"}, "springs: expected 'native' with the twin, got 'cubic'"),
        ({"substeps": 2}, "substeps: expected 1 with the twin, got 2"),
        ({"feedback_delay": 1}, "feedback_delay: expected 0 with the twin, got 1"),
    ):
        with pytest.raises(InvalidArgumentError) as caught:
            mcmj.Simulation(body, engine="twin", **options)
        assert str(caught.value) == text
    with pytest.raises(UnknownNameError, match="Euler, RK4, adaptive_leapfrog, leapfrog"):
        mcmj.Simulation(body, engine="twin", integrator="discrete")
    with pytest.raises(UnknownNameError, match="mujoco, tendons, twin"):
        mcmj.Simulation(body, engine="jax")
    with pytest.raises(
        UnknownNameError, match=r"record .positions.; valid choices: lengths, outputs"
    ):
        mcmj.Simulation(body, engine="twin").rollout(1, record=("positions",))


def test_divergence(body, w_out):
    simulation = mcmj.Simulation(body, w_out=1e7 * w_out, engine="twin")
    with pytest.raises(DivergenceError, match=r"blew up after t = .* at node \d+"):
        simulation.rollout(3000)
