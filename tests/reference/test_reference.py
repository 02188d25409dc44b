"""The reference integrators against the authors' program, exact solutions and each other."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

import mcmj
from mcmj.core.body import spring_lengths
from mcmj.reference.integration import METHODS, integrate, integrate_smooth
from mcmj.utils.errors import DivergenceError, UnknownNameError

FIXTURE = Path(__file__).parents[1] / "data" / "toolbox_rk.npz"


@pytest.fixture(scope="module")
def toolbox():
    with np.load(FIXTURE) as data:
        return dict(data)


def toolbox_body(data):
    return mcmj.Body(
        data["positions"],
        data["springs"],
        *(data[name] for name in ("k1", "k3", "d1", "d3", "rest_lengths")),
        data["fixed"].astype(bool),
        data["w_in"],
        data["w_fb"],
    )


def test_toolbox_rk_is_the_authors_program(toolbox):
    body, step = toolbox_body(toolbox), float(toolbox["timestep"])
    taught = integrate(
        body,
        method="toolbox_rk",
        timestep=step,
        inputs=toolbox["inputs"],
        offset=toolbox["teacher"],
        gate=0,
    )
    assert np.abs(taught.lengths - toolbox["teacher_lengths"]).max() < 1e-13  # measured 3e-15
    closed = integrate(
        body,
        method="toolbox_rk",
        timestep=step,
        inputs=toolbox["inputs"],
        w_out=toolbox["w_out"],
        initial_state=taught.final_state,
    )
    assert np.abs(closed.lengths - toolbox["closed_lengths"]).max() < 1e-13
    assert np.abs(closed.outputs - toolbox["closed_outputs"]).max() < 1e-13


def oscillator(k=9.0, d=0.8, mass=2.0):
    """A mass on one linear spring, pulled along x from a fixed node."""
    return mcmj.Body(
        [[0.0, 0.0], [1.0, 0.0]], [[0, 1]], [k], [0], [d], [0], fixed=[True, False],
        masses=[1.0, mass],
    )  # fmt: skip


def exact_oscillator(times, force, k=9.0, d=0.8, mass=2.0):
    """Elongation from rest under a constant force switched on at t = 0."""
    decay, omega = d / (2 * mass), np.sqrt(k / mass - (d / (2 * mass)) ** 2)
    ring = np.cos(omega * times) + decay / omega * np.sin(omega * times)
    return force / k * (1 - np.exp(-decay * times) * ring)


@pytest.mark.parametrize(
    ("method", "tolerance"),
    [("dop853", 1e-11), ("rk4", 1e-12), ("semi_implicit_euler", 1e-3), ("toolbox_rk", 1e-3)],
)
def test_one_mass_one_spring(method, tolerance):
    run = integrate(oscillator(), method=method, steps=4000, forces=[0.0, 1.5])
    error = np.abs(run.lengths[:, 0] - 1.0 - exact_oscillator(run.times, 1.5)).max()
    assert error < tolerance


@pytest.mark.parametrize(
    ("method", "order"),
    [("semi_implicit_euler", 1), ("toolbox_euler", 1), ("toolbox_rk", 1), ("rk4", 4)],
)
def test_order_of_convergence(method, order):
    errors = []
    for step in (0.02, 0.01, 0.005):
        run = integrate(
            oscillator(), method=method, steps=round(2 / step), timestep=step, forces=[0.0, 1.5]
        )
        end = run.final_state.positions[1, 0] - 1.0
        errors.append(abs(end - exact_oscillator(2.0, 1.5)))
    slopes = np.diff(np.log2(errors))
    assert np.all(np.abs(-slopes - order) < 0.15), slopes


def test_symmetric_pair_stays_symmetric():
    body = mcmj.Body(
        [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[0, 1], [1, 2]], [5, 5], [100, 100], [1, 1],
        [50, 50], fixed=[False, True, False],
    )  # fmt: skip
    run = integrate(body, method="rk4", steps=3000, forces=[-2.0, 0.0, 2.0])
    assert np.abs(run.lengths[:, 0] - run.lengths[:, 1]).max() < 1e-14
    assert run.lengths.max() > 1.05  # it did move


def kicked(body, rng, speed=0.5):
    speeds = rng.uniform(-speed, speed, (body.n_nodes, 2)) * ~body.fixed[:, None]
    return mcmj.core.trajectory.State(body.positions, speeds)


def potential(body, lengths):
    x1 = lengths - body.rest_lengths
    return (body.k1 * x1**2 / 2 + body.k3 * x1**4 / 4).sum(axis=-1)


def kinetic(body, velocities):
    return (body.masses[:, None] * velocities**2).sum() / 2


def test_energy_balance():
    """Work of the forces = change of energy + what the dampers dissipate."""
    body = mcmj.random_body(3, 12, width=2, height=2)
    rng = np.random.default_rng(0)
    forces = rng.uniform(-1, 1, body.n_nodes)
    step, steps = 2e-4, 1000
    state = kicked(body, rng, speed=0.2)
    before = potential(body, spring_lengths(state.positions, body.springs)) + kinetic(
        body, state.velocities
    )
    power = []
    for _ in range(steps):  # instantaneous powers at every step, summed by Simpson's rule
        power.append(_power(body, state, forces))
        state = integrate(
            body, method="rk4", steps=1, timestep=step, forces=forces, initial_state=state
        ).final_state
    power.append(_power(body, state, forces))
    after = potential(body, spring_lengths(state.positions, body.springs)) + kinetic(
        body, state.velocities
    )
    balance = simpson(power, dx=step)
    assert abs(before - after) > 0.01
    assert balance == pytest.approx(after - before, rel=1e-6)


def _power(body, state, forces):
    """Power of the forces minus what the dampers take [W]."""
    gap = np.diff(state.positions[body.springs], axis=1)[:, 0]
    closing = np.diff(state.velocities[body.springs], axis=1)[:, 0]
    rate = (gap * closing).sum(axis=1) / np.linalg.norm(gap, axis=1)
    dissipated = (body.d1 * rate**2 + body.d3 * rate**4).sum()
    return (forces * state.velocities[:, 0]).sum() - dissipated


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4", "dop853", "toolbox_rk"])
def test_momentum_without_fixed_nodes(method):
    body = mcmj.random_body(5, 12, width=2, height=2, masses=(0.5, 2.0))
    body = mcmj.Body(
        body.positions, body.springs, body.k1, body.k3, body.d1, body.d3,
        fixed=np.zeros(12, bool), masses=body.masses,
    )  # fmt: skip
    start = kicked(body, np.random.default_rng(1))
    run = integrate(body, method=method, steps=200, initial_state=start)
    momenta = [body.masses @ s.velocities for s in (start, run.final_state)]
    assert np.abs(momenta[0] - momenta[1]).max() < 1e-13
    assert np.abs(run.final_state.velocities - start.velocities).max() > 0.1


@pytest.mark.parametrize("reflect", [False, True])
def test_rotation_and_reflection(reflect):
    body = mcmj.random_body(7, 15)
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if reflect:
        turn = turn @ np.diag([1.0, -1.0])
    turned = mcmj.Body(
        body.positions @ turn.T, body.springs, body.k1, body.k3, body.d1, body.d3,
        fixed=body.fixed, masses=body.masses,
    )  # fmt: skip
    start = kicked(body, np.random.default_rng(2))
    rotated = mcmj.core.trajectory.State(start.positions @ turn.T, start.velocities @ turn.T)
    runs = [
        integrate(b, method="rk4", steps=500, initial_state=s)
        for b, s in ((body, start), (turned, rotated))
    ]
    assert np.abs(runs[0].lengths - runs[1].lengths).max() < 1e-11


@pytest.mark.parametrize(
    ("method", "integrator"), [("semi_implicit_euler", "Euler"), ("rk4", "RK4")]
)
def test_twins_are_mujocos_integrators(method, integrator):
    rng = np.random.default_rng(4)
    body = mcmj.random_body(11, 30, n_inputs=1, masses=(0.5, 2.0))
    steps = 10_000
    drive = {
        "inputs": rng.uniform(-1, 1, (steps, 1)),
        "offset": rng.uniform(-0.1, 0.1, (steps, 2)),
        "gate": [1.0, 0.5],
        "forces": rng.uniform(-1, 1, body.n_nodes),
        "w_out": 1e-3 * rng.standard_normal((body.n_springs + 1, 2)),
    }
    w_out = drive.pop("w_out")
    simulation = mcmj.Simulation(body, w_out=w_out, integrator=integrator)
    there = simulation.rollout(**drive)
    here = integrate(body, method=method, w_out=w_out, **drive)
    assert np.abs(there.lengths - here.lengths).max() < 1e-12
    assert np.abs(there.outputs - here.outputs).max() < 1e-12
    ends = there.final_state.positions - here.final_state.positions
    assert np.abs(ends).max() < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_a_run_continues_from_its_final_state(method):
    body = mcmj.random_body(2, 10)
    offset = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    w_out = 1e-3 * np.ones((body.n_springs, 2))
    whole = integrate(body, method=method, offset=offset, w_out=w_out)
    first = integrate(body, method=method, offset=offset[:35], w_out=w_out)
    rest = integrate(
        body, method=method, offset=offset[35:], w_out=w_out, initial_state=first.final_state
    )
    joined = np.concatenate([first.lengths, rest.lengths])
    assert np.abs(joined - whole.lengths).max() < (1e-13 if method == "dop853" else 1e-300)
    assert rest.times[0] == pytest.approx(0.035)


def test_dop853_agrees_with_itself_and_with_continuous_feedback():
    body = mcmj.random_body(4, 10)
    w_out = 1e-2 * np.random.default_rng(3).standard_normal((body.n_springs, 2))
    start = kicked(body, np.random.default_rng(5))
    options = {"method": "dop853", "steps": 200, "w_out": w_out, "initial_state": start}
    loose, tight = (integrate(body, **options, rtol=r).lengths for r in (1e-9, 1e-13))
    assert np.abs(loose - tight).max() < 1e-9
    smooth = integrate_smooth(body, steps=200, w_out=w_out, initial_state=start)
    held = [
        integrate(body, **(options | {"steps": 200 * n}), timestep=1e-3 / n).lengths[::n]
        for n in (1, 2)
    ]
    errors = [np.abs(h - smooth.lengths).max() for h in held]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1)  # holding is of first order


def test_smooth_signals():
    body = oscillator()
    body = mcmj.Body(
        body.positions, body.springs, body.k1, body.k3, body.d1, body.d3, fixed=body.fixed,
        masses=body.masses, w_in=[[0.0], [1.0]],
    )  # fmt: skip
    run = integrate_smooth(body, steps=3000, inputs=lambda t: np.array([1.5]))
    error = np.abs(run.lengths[:, 0] - 1.0 - exact_oscillator(run.times, 1.5)).max()
    assert error < 1e-11


@pytest.mark.parametrize("method", METHODS)
def test_divergence_is_an_error(method):
    body = mcmj.random_body(1, 8)
    with pytest.raises(DivergenceError, match="blew up"):
        integrate(body, method=method, steps=400, w_out=1e7 * np.ones((body.n_springs, 2)))


def test_unknown_method_lists_the_choices():
    with pytest.raises(UnknownNameError, match=r"dop853.*toolbox_rk"):
        integrate(mcmj.random_body(0, 5), method="heun", steps=1)
