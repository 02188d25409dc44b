"""The adaptive leapfrog: accurate where dampers are stiff, the leapfrog where they are not."""

import numpy as np
import pytest
from leapfrogs import error, kicked, push, readout, small_body, toolbox_body
from scipy.integrate import solve_ivp
from spatial import lifted

import mcmj
from mcmj.core.body import damper_reach
from mcmj.core.trajectory import State
from mcmj.experiments.hard_cases.bodies import CASES
from mcmj.reference import plain_steps
from mcmj.reference.dop853 import accelerations
from mcmj.reference.integration import integrate
from mcmj.simulation.stepsize.linearisation import linear_system
from mcmj.utils.errors import DivergenceError, InvalidArgumentError

ADAPTIVE = {"method": "adaptive_leapfrog"}


def stiff_body(seed=1, nodes=10):
    return toolbox_body(seed, nodes, d3=(1e3, 1e4), n_inputs=1)


def relative_error(state, exact, body):
    return error(state, exact) / np.linalg.norm(exact.positions - body.positions)


@pytest.mark.parametrize("make", [toolbox_body, small_body])
def test_slow_motion_is_the_leapfrog_bit_for_bit(make):
    body = make(2)
    run = {"steps": 300, "w_out": readout(body), "offset": np.full((300, 2), 0.3)}
    ends = [integrate(body, method=m, **run) for m in ("leapfrog", "adaptive_leapfrog")]
    assert np.array_equal(ends[0].lengths, ends[1].lengths)
    assert np.array_equal(ends[0].final_state.history, ends[1].final_state.history)
    assert np.ptp(ends[0].lengths, axis=0).max() > 1e-3


@pytest.mark.parametrize("step", [4e-3, 1e-3, 2.5e-4])
def test_stiff_dampers_against_dop853(step):
    """MuJoCo's `discrete` errs by 2e-2 at 1 ms; what is left here is the parts' error."""
    body = stiff_body()
    run = {"timestep": step, "steps": round(0.2 / step), "forces": push(body)}
    run["initial_state"] = kicked(body)
    exact = integrate(body, method="dop853", **run).final_state
    found = integrate(body, **ADAPTIVE, **run).final_state
    assert relative_error(found, exact, body) < 2e-4
    assert np.abs(found.velocities - exact.velocities).max() < 2e-5
    if step == 1e-3:
        simulation = mcmj.Simulation(body, integrator="discrete")
        simulation.set_state(velocities=run["initial_state"].velocities)
        simulation.rollout(run["steps"], forces=push(body))
        discrete = relative_error(simulation.state, exact, body)
        assert relative_error(found, exact, body) < 0.01 * discrete


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [("stiff_dampers", 1e-3), ("stiff_linear_dampers", 1e-3), ("fast_start", 1e-3),
     ("unequal_masses", 5e-6), ("large_forces", 2e-2)],
)  # fmt: skip
def test_hard_cases_against_an_implicit_method(name, tolerance):
    case = CASES[name](0)
    body, shape = case.body, (2, *case.body.positions.shape)

    def rhs(t, x):
        p, v = x.reshape(shape)
        return np.stack([v, accelerations(body, p, v, case.forces)]).ravel()

    start = np.stack([body.positions, case.velocities]).ravel()
    last = solve_ivp(rhs, (0.0, 0.2), start, method="LSODA", rtol=1e-9, atol=1e-11).y[:, -1]
    exact = State(*last.reshape(shape))
    found = integrate(
        body, **ADAPTIVE, steps=200, forces=case.forces,
        initial_state=State(body.positions, case.velocities),
    ).final_state  # fmt: skip
    assert relative_error(found, exact, body) < tolerance


@pytest.mark.parametrize("d3", [1e2, 1e6, 1e10])
def test_one_mass_on_a_cubic_damper(d3):
    """v = v0 / sqrt(1 + 2 d3 v0^2 t / m), whatever the step."""
    mass, speed, tiny = 0.5, 3.0, 1e-12
    body = mcmj.Body(
        [(0, 0), (1, 0)], [(0, 1)], [tiny], [0.0], [tiny], [d3], masses=[1.0, mass],
        fixed=np.array([True, False]),
    )  # fmt: skip
    start = State(body.positions, np.array([[0.0, 0.0], [speed, 0.0]]))
    for step in (1e-4, 1e-2, 0.1):
        end = integrate(
            body, **ADAPTIVE, steps=2, timestep=step, initial_state=start
        ).final_state.velocities[1, 0]
        exact = speed / np.sqrt(1.0 + 2.0 * d3 * speed**2 * 2 * step / mass)
        assert end == pytest.approx(exact, rel=0.05)


def test_shorter_parts_are_of_second_order(monkeypatch):
    body = lifted(stiff_body())
    v = np.column_stack([kicked(stiff_body()).velocities, np.zeros(body.n_nodes)])
    run = {"steps": 5, "initial_state": State(body.positions, v), "forces": push(body)}
    exact = integrate(body, method="dop853", **run).final_state
    errors = []
    for limit in (0.2, 0.1, 0.05):
        monkeypatch.setattr(plain_steps, "TOO_FAST", limit)
        errors.append(error(integrate(body, **ADAPTIVE, **run).final_state, exact))
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 1.8)


@pytest.mark.parametrize("closed", [False, True])
def test_plain_numpy_takes_the_same_parts(closed):
    body = stiff_body()
    flat, rng = kicked(body), np.random.default_rng(3)
    run = {
        **ADAPTIVE, "inputs": rng.uniform(-9, 9, (60, 1)), "offset": rng.uniform(-9, 9, (60, 2)),
        "forces": push(body), "w_out": np.vstack([readout(body), [0.5, -0.5]]) if closed else None,
    }  # fmt: skip
    raised = State(*(np.column_stack([a, np.zeros(10)]) for a in (flat.positions, flat.velocities)))
    compiled = integrate(body, initial_state=flat, **run)
    plain = integrate(lifted(body), initial_state=raised, **run)
    assert np.abs(compiled.lengths - plain.lengths).max() < 1e-12
    assert np.abs(compiled.outputs - plain.outputs).max() < 1e-11
    ends = compiled.final_state.velocities, plain.final_state.velocities[:, :2]
    assert np.abs(ends[0] - ends[1]).max() < 1e-11
    with pytest.raises(DivergenceError):  # it could not do without parts
        integrate(body, initial_state=flat, **{**run, "method": "leapfrog"})


def test_simulation_goes_on_bit_for_bit_and_copies_are_alike():
    body, start = stiff_body(), kicked(stiff_body())
    options = {"integrator": "adaptive_leapfrog", "engine": "twin", "w_out": readout(body)}
    simulation = mcmj.Simulation(body, **options)
    simulation.set_state(velocities=start.velocities)
    run = integrate(body, **ADAPTIVE, steps=30, w_out=readout(body), initial_state=start)
    first = simulation.rollout(2)  # ends amid steps that are taken in parts
    kept = simulation.snapshot()
    for _ in range(2):
        simulation.restore(kept)
        lengths = np.vstack([first.lengths, simulation.rollout(28).lengths])
        assert np.array_equal(lengths, run.lengths)
    ensemble = mcmj.Ensemble(body, copies=5, threads=2, **options)
    ensemble.set_state(velocities=start.velocities)
    assert all(np.array_equal(one, run.lengths) for one in ensemble.rollout(30).lengths)


def test_what_cannot_be_integrated_is_an_error():
    body = stiff_body()
    with pytest.raises(DivergenceError, match=r"blew up after t = 0 s .* adaptive_leapfrog"):
        integrate(body, **ADAPTIVE, steps=3, initial_state=kicked(body, 1e150))
    with pytest.raises(InvalidArgumentError, match="engine: expected 'twin' for adaptive_leapfrog"):
        mcmj.Simulation(body, integrator="adaptive_leapfrog")


@pytest.mark.parametrize("seed", range(5))
def test_the_reach_of_a_damper_bounds_the_rate(seed):
    """Of any spring's slopes, and at most the number of springs at a node above the exact one."""
    body = mcmj.random_body(seed, 12, masses=(0.1, 10.0), d1=(0.1, 100.0))
    system = linear_system(body)
    rates = np.linalg.eigvals(system.damping.toarray() / system.masses[:, None]).real
    assert rates.max() < system.damper_rate < 10 * rates.max()
    assert system.damper_rate == (damper_reach(body) * body.d1).max()
