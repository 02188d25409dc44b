"""The leapfrog in MuJoCo and in the twin: order and error, with every option."""

from dataclasses import replace

import numpy as np
import pytest
from leapfrogs import error, in_mujoco, kicked, push, readout, small_body, toolbox_body

import mcmj
from mcmj.reference.integration import integrate

TWIN_OF = {"Euler": "semi_implicit_euler", "leapfrog": "leapfrog"}


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("make", [toolbox_body, small_body])
def test_order_two(make, closed):
    body = make(2)
    w_out = readout(body) if closed else None
    errors, speeds = [], []
    for step in (2e-3, 1e-3, 5e-4):
        run = {"timestep": step, "steps": round(0.5 / step), "w_out": w_out, "forces": push(body)}
        exact = integrate(body, method="dop853", **run).final_state
        state = in_mujoco(body, "leapfrog", run["steps"], w_out, step).state
        errors.append(error(state, exact))
        speeds.append(np.linalg.norm(state.velocities - exact.velocities))
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 1.9)
    assert np.all(np.log2(np.divide(speeds[:-1], speeds[1:])) > 1.9)


@pytest.mark.parametrize("speed", [0.0, 0.5])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("make", [toolbox_body, small_body])
@pytest.mark.parametrize(
    ("seed", "nodes"),
    [(1, 12), (3, 12)] + [pytest.param(s, 30, marks=pytest.mark.slow) for s in (0, 2, 4, 5)],
)
def test_ten_times_less_error_than_euler(make, seed, nodes, closed, speed):
    body = make(seed, nodes)
    w_out = readout(body) if closed else None
    run = {"steps": 500, "w_out": w_out, "forces": push(body), "initial_state": kicked(body, speed)}
    exact = integrate(body, method="dop853", **run).final_state
    errors = {
        name: error(integrate(body, method=twin, **run).final_state, exact)
        for name, twin in TWIN_OF.items()
    }
    assert errors["leapfrog"] < 0.1 * errors["Euler"]  # measured 1/36 to 1/480


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize(("make", "tolerance"), [(toolbox_body, 5e-12), (small_body, 5e-14)])
def test_mujoco_is_the_twin(make, tolerance, closed):
    body = make(4, 30)
    w_out, start = readout(body) if closed else None, kicked(body)
    state = in_mujoco(body, "leapfrog", 2000, w_out, start=start).state
    twin = integrate(
        body, method="leapfrog", steps=2000, forces=push(body), w_out=w_out, initial_state=start
    ).final_state
    assert np.abs(state.positions - twin.positions).max() < tolerance
    assert np.abs(state.velocities - twin.velocities).max() < 2 * tolerance


def test_velocities_follow_a_sudden_force():
    body = toolbox_body(0)
    forces = np.zeros((21, body.n_nodes))
    forces[20] = 50.0
    exact = integrate(body, method="dop853", forces=forces).final_state
    twin = integrate(body, method="leapfrog", forces=forces).final_state
    simulation = mcmj.Simulation(body, integrator="leapfrog")
    simulation.rollout(forces=forces)
    one = integrate(body, method="leapfrog", forces=forces[20:]).final_state
    for state in (twin, simulation.state, one):
        assert np.abs(state.velocities - exact.velocities).max() < 5e-5  # of 0.05 m/s


def test_substeps_are_smaller_steps():
    body = toolbox_body(2)
    coarse = in_mujoco(body, "leapfrog", 100, substeps=4)
    fine = in_mujoco(body, "leapfrog", 400, timestep=2.5e-4)
    assert np.abs(coarse.state.positions - fine.state.positions).max() < 1e-12
    assert np.abs(coarse.state.velocities - fine.state.velocities).max() < 1e-12


@pytest.mark.parametrize("options", [{"substeps": 4}, {"springs": "tansig"}])
def test_options_keep_the_order(options):
    body = toolbox_body(2)
    if "springs" in options:  # slopes like the other's
        body = replace(body, k3=body.k3 / 100, d3=body.d3 / 100)
    exact = in_mujoco(body, "RK4", 500, readout(body), **options).state
    errors = {
        name: error(in_mujoco(body, name, 500, readout(body), **options).state, exact)
        for name in TWIN_OF
    }
    assert errors["leapfrog"] < 0.01 * errors["Euler"]  # measured 0.0006, 0.0013


def test_delayed_feedback_is_the_output_before():
    body = toolbox_body(2)
    late = mcmj.Simulation(body, w_out=readout(body), integrator="leapfrog", feedback_delay=1)
    run = late.rollout(200, forces=push(body))
    replayed = mcmj.Simulation(body, integrator="leapfrog")
    replayed.rollout(offset=np.vstack([np.zeros((1, 2)), run.outputs[:-1]]), forces=push(body))
    assert error(late.state, replayed.state) < 1e-13


def test_a_law_gives_what_native_springs_give():
    body = toolbox_body(3)
    states = [
        in_mujoco(body, "leapfrog", 500, readout(body), springs=springs).state
        for springs in ("native", "cubic")
    ]
    assert error(*states) < 1e-13
