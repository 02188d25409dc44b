"""The leapfrog in MuJoCo and in the twin: order, error, restarts, and leaving others alone."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import mcmj
from mcmj import laws
from mcmj.drive import check_drive
from mcmj.reference import integrate
from mcmj.twin.population import Population

FULL = mujoco.mjtState.mjSTATE_INTEGRATION.value
TWIN_OF = {"Euler": "semi_implicit_euler", "leapfrog": "leapfrog"}


def toolbox_body(seed, nodes=12, **settings):
    return mcmj.random_body(seed, nodes, d1=(0.1, 2.0), feedback_scale=10.0, **settings)


def small_body(seed, nodes=12):
    return toolbox_body(seed, nodes, width=1.0, height=1.0)


def readout(body, scale=3.0):
    """Random weights whose outputs are 0 at rest."""
    w = np.random.default_rng(5).normal(size=(body.n_springs, body.n_outputs))
    l0 = body.rest_lengths
    return scale * (w - np.outer(l0, l0 @ w) / (l0 @ l0)) / np.sqrt(len(l0))


def push(body):
    rng = np.random.default_rng(7)
    return rng.uniform(1, 10, body.n_nodes) * rng.choice([-1, 1], body.n_nodes)


def kicked(body, speed=0.5):
    """The body's start with every free node moving at that speed."""
    v = np.random.default_rng(9).normal(size=body.positions.shape)
    v *= speed / np.linalg.norm(v, axis=1)[:, None]
    return mcmj.trajectory.State(body.positions, np.where(body.fixed[:, None], 0.0, v))


def error(state, exact):
    return np.linalg.norm(state.positions - exact.positions)


def in_mujoco(body, integrator, steps, w_out=None, timestep=1e-3, start=None, **options):
    simulation = mcmj.Simulation(
        body, w_out=w_out, integrator=integrator, timestep=timestep, **options
    )
    if start is not None:
        simulation.set_state(start.positions, start.velocities)
    simulation.rollout(steps, forces=push(body))
    return simulation


# --- order and error ------------------------------------------------------------------------


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


# --- the twin's state -----------------------------------------------------------------------


def test_twin_continues_bit_for_bit():
    body = toolbox_body(1)
    run = {"method": "leapfrog", "w_out": readout(body), "forces": push(body)}
    whole = integrate(body, steps=70, **run)
    for split in (1, 2, 30, 69):
        first = integrate(body, steps=split, **run)
        rest = integrate(body, steps=70 - split, initial_state=first.final_state, **run)
        joined = np.concatenate([first.lengths, rest.lengths])
        assert np.array_equal(joined, whole.lengths)
        assert np.array_equal(rest.final_state.velocities, whole.final_state.velocities)
        assert np.array_equal(rest.final_state.history, whole.final_state.history)


def test_changed_velocities_make_the_history_void():
    body = toolbox_body(1)
    state = integrate(body, method="leapfrog", steps=50, forces=push(body)).final_state
    moved = replace(state, velocities=kicked(body).velocities)
    runs = [
        integrate(body, method="leapfrog", steps=50, initial_state=start).final_state.positions
        for start in (moved, replace(moved, history=None), state)
    ]
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_packs_are_the_single_bodies():
    body = toolbox_body(1)
    bodies = [replace(body, k1=body.k1 * f, masses=body.masses * f) for f in (1.0, 1.5, 2, 0.7, 3)]
    readouts = [readout(body, 0.5 * i) for i in range(5)]
    starts = [kicked(body, 0.1 * i) for i in range(5)]
    drive = check_drive(
        body, steps=300, inputs=None, offset=None, gate=None, forces=push(body), closed=True
    )

    def run(packed, *parts):
        population = Population(
            bodies, readouts, method="leapfrog", states=starts, packed=packed, threads=2
        )
        for first, last in parts:
            population.run(drive, first, last)
        return population.states

    single, whole = run(False, (0, 300)), run(True, (0, 300))
    for a, b in zip(single, whole, strict=True):
        assert np.abs(a.positions - b.positions).max() < 1e-13
        assert np.abs(a.history - b.history).max() < 5e-13
    for packed, once in ((False, single), (True, whole)):
        for a, b in zip(run(packed, (0, 1), (1, 120), (120, 300)), once, strict=True):
            assert np.array_equal(a.positions, b.positions)
            assert np.array_equal(a.history, b.history)


# --- MuJoCo's state -------------------------------------------------------------------------


def test_restore_reset_and_chunks_are_bit_for_bit():
    body = toolbox_body(1)
    simulation = mcmj.Simulation(body, w_out=readout(body), integrator="leapfrog")
    record = ("lengths", "velocities")
    whole = simulation.rollout(60, forces=push(body), record=record)
    simulation.reset()
    first = simulation.rollout(25, forces=push(body), record=record)
    snapshot = simulation.snapshot()
    for _ in range(2):
        rest = simulation.rollout(35, forces=push(body), record=record)
        for name in record:
            joined = np.concatenate([first.get(name), rest.get(name)])
            assert np.array_equal(joined, whole.get(name))
        simulation.restore(snapshot)
    assert np.array_equal(simulation.state.velocities, whole.velocities[25])


def test_batch_is_mj_step():
    body = toolbox_body(2)
    w_out = readout(body)
    copies = mcmj.Ensemble(body, copies=3, threads=2, w_out=w_out, integrator="leapfrog")
    copies.set_state(velocities=kicked(body).velocities)
    copies.rollout(80)
    model = mujoco.MjModel.from_xml_string(
        mcmj.to_mjcf(body, integrator="leapfrog", w_out=np.vstack([w_out, np.zeros(2)]))
    )
    data = mujoco.MjData(model)
    data.qvel = kicked(body).velocities[body.free].ravel()
    for _ in range(80):
        mujoco.mj_step(model, data)
    free = body.positions[body.free] + data.qpos.reshape(-1, 2)
    assert np.array_equal(copies.state.positions[:, body.free], np.tile(free, (3, 1, 1)))


def full_state(model, data):
    state = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, state, FULL)
    return state


def test_forward_changes_nothing():
    body = toolbox_body(2)
    laws.install(leapfrog=True)
    model = mujoco.MjModel.from_xml_string(
        mcmj.to_mjcf(body, integrator="leapfrog", w_out=readout(body))
    )
    ends = []
    for looks in (0, 2):
        data = mujoco.MjData(model)
        for k in range(40):
            for ctrl in range(looks):  # with other offsets too
                data.ctrl[:] = 5.0 * ctrl
                mujoco.mj_forward(model, data)
            data.ctrl[:] = np.sin(0.1 * k)
            mujoco.mj_step(model, data)
        ends.append(full_state(model, data))
    assert np.array_equal(*ends)
    mujoco.mj_resetData(model, data)
    assert not data.userdata.any()


def test_current_lengths_change_nothing():
    body = toolbox_body(2)
    plain = mcmj.Simulation(body, w_out=readout(body), integrator="leapfrog")
    hooked = mcmj.Simulation(body, w_out=readout(body), integrator="leapfrog")
    a = plain.rollout(30, forces=push(body))
    b = hooked.rollout(30, hook=lambda time, lengths: push(body))
    assert np.array_equal(a.lengths, b.lengths)


def test_set_state_starts_anew():
    body = toolbox_body(2)
    used = in_mujoco(body, "leapfrog", 40)
    state = used.state
    used.set_state(positions=state.positions)  # the velocities stay
    assert np.array_equal(used.state.velocities, state.velocities)
    fresh = in_mujoco(body, "leapfrog", 40, start=state)
    used.rollout(40, forces=push(body))
    assert np.array_equal(used.state.positions, fresh.state.positions)


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


# --- leaving others alone -------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast", "discrete"])
def test_other_integrators_run_as_before(integrator):
    body = toolbox_body(1)
    states = []
    for leapfrog in (False, True):
        laws.uninstall()
        laws.install(leapfrog=leapfrog)
        states.append(in_mujoco(body, integrator, 50, readout(body)).snapshot())
    assert np.array_equal(*states)


def test_other_models_run_as_before():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint type='hinge' axis='0 1 0' damping='.1' stiffness='2'/>"
        "<geom size='.1' pos='.3 0 0'/></body></worldbody></mujoco>"
    )
    ends = []
    for leapfrog in (False, True):
        laws.uninstall()
        laws.install(leapfrog=leapfrog)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 50)
        ends.append(full_state(model, data))
    assert np.array_equal(*ends)


def test_a_file_is_euler_without_our_callbacks():
    body = toolbox_body(1)
    laws.uninstall()
    ends = []
    for integrator in ("leapfrog", "Euler"):
        model = mujoco.MjModel.from_xml_string(mcmj.to_mjcf(body, integrator=integrator))
        data = mujoco.MjData(model)
        data.qvel = kicked(body).velocities[body.free].ravel()
        mujoco.mj_step(model, data, 50)
        ends.append(data.qpos.copy())
    assert np.array_equal(*ends)
    again, _ = mcmj.from_mjcf(mcmj.to_mjcf(body, integrator="leapfrog"))
    assert np.array_equal(again.positions, body.positions)
