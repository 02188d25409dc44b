"""The leapfrog's memory: restarts, chunks, looks in between, and leaving others alone."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from leapfrogs import full_state, in_mujoco, kicked, push, readout, toolbox_body

import mcmj
from mcmj.core.callbacks import install
from mcmj.core.rollout_arguments import check_drive
from mcmj.reference.integration import integrate
from mcmj.reference.twin.population import Population


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
    drive = check_drive(body, steps=300, forces=push(body), closed=True)

    def run(packed, *parts):
        population = Population(bodies, readouts, method="leapfrog", packed=packed, threads=2)
        population.set_states(starts)
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


def test_forward_changes_nothing():
    body = toolbox_body(2)
    install.install(passive=True)
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


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast", "discrete"])
def test_other_integrators_run_as_before(integrator):
    body = toolbox_body(1)
    states = []
    for leapfrog in (False, True):
        install.uninstall()
        install.install(passive=leapfrog)
        states.append(in_mujoco(body, integrator, 50, readout(body)).snapshot())
    assert np.array_equal(*states)


def test_other_models_run_as_before():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint type='hinge' axis='0 1 0' damping='.1' stiffness='2'/>"
        "<geom size='.1' pos='.3 0 0'/></body></worldbody></mujoco>"
    )
    ends = []
    for leapfrog in (False, True):
        install.uninstall()
        install.install(passive=leapfrog)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 50)
        ends.append(full_state(model, data))
    assert np.array_equal(*ends)


def test_a_file_is_euler_without_our_callbacks():
    body = toolbox_body(1)
    install.uninstall()
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
