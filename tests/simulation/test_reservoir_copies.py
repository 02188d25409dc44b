"""Copies, forces, damage, files and compiled models as reservoirs, against plain MuJoCo."""

import mujoco
import numpy as np
import pytest
from models import ARM, ARM_CHANNELS, ARM_SENSORS, driven

import mcmj
from mcmj import Reservoir
from mcmj.utils.errors import (
    BodyFileError,
    InvalidArgumentError,
    McmjError,
    UnknownNameError,
)


def test_a_file_is_complete(tmp_path):
    reservoir, w_out, _, offset, inputs = driven("RK4")
    reservoir.set_readout(w_out)
    (tmp_path / "arm.xml").write_text(reservoir.to_mjcf())
    again = Reservoir.open(tmp_path / "arm.xml")
    assert again.channel_names == reservoir.channel_names
    assert np.array_equal(again.w_out, w_out)
    one, other = (r.rollout(inputs=inputs[:300], offset=offset[:300]) for r in (reservoir, again))
    assert np.abs(one.signals - other.signals).max() < 2e-13
    with pytest.raises(BodyFileError, match="not the file of a reservoir"):
        Reservoir.open(ARM)


def test_a_compiled_model_keeps_its_numbers():
    model = mujoco.MjModel.from_xml_string(ARM)
    model.dof_damping[:] = [1 / 3, 2 / 3, 1 / 7]
    model.opt.gravity[2] = -1 / 3
    before = model.dof_damping.copy()
    reservoir = Reservoir(model, sensors="jointpos:*", channels=ARM_CHANNELS)
    run = reservoir.rollout(offset=np.ones((1000, 3)), record=("qpos", "qvel"))
    data = mujoco.MjData(model)
    data.ctrl[:] = [1.5, -0.5, 1.0, 0.0, 0.3, 1.0]
    mujoco.mj_step(model, data, 999)
    assert np.array_equal(run.qpos[-1], data.qpos)
    assert np.array_equal(run.qvel[-1], data.qvel)
    assert np.array_equal(model.dof_damping, before)
    assert model.nu == 6


def test_copies_are_what_they_are_alone_on_any_number_of_threads():
    given = {"sensors": ARM_SENSORS, "channels": ARM_CHANNELS, "inputs": ["free"]}
    rng = np.random.default_rng(1)
    alone = Reservoir(ARM, **given)
    w_out = 0.02 * rng.normal(size=(3, alone.n_signals + 1, 3))
    offset, inputs = rng.normal(size=(3, 400, 3)), rng.normal(size=(400, 1))
    qvel = rng.normal(size=(3, 3))
    runs = []
    for threads in (1, 2):
        copies = Reservoir(ARM, **given, copies=3, threads=threads, w_out=w_out)
        copies.set_state(qvel=qvel)
        first = copies.rollout(inputs=inputs[:150], offset=offset[:, :150])
        copies.restore(copies.snapshot())
        rest = copies.rollout(inputs=inputs[150:], offset=offset[:, 150:])
        runs.append(np.concatenate([first.signals, rest.signals], axis=1))
    assert np.array_equal(*runs)
    for k in range(3):
        alone.reset()
        alone.set_state(qvel=qvel[k])
        alone.set_readout(w_out[k])
        run = alone.rollout(inputs=inputs, offset=offset[k])
        assert np.array_equal(run.signals, runs[0][k])
    assert np.array_equal(copies.signals.shape, (3, alone.n_signals))


def test_forces_act_on_joints_and_on_bodies():
    model = mujoco.MjModel.from_xml_string(ARM)
    for forces, field in (
        (np.array([0.3, -0.2, 0.1]), "qfrc_applied"),
        ({"b": (1.0, 2.0, -3.0)}, "xfrc_applied"),
    ):
        reservoir = Reservoir(ARM, sensors="q1", channels=["m1"])
        run = reservoir.rollout(500, forces=forces, record=("qpos",))
        after = reservoir.rollout(2, record=("qpos",))
        data = mujoco.MjData(model)
        if field == "qfrc_applied":
            data.qfrc_applied[:] = forces
        else:
            data.xfrc_applied[model.body("b").id, :3] = forces["b"]
        mujoco.mj_step(model, data, 499)
        assert np.array_equal(run.qpos[-1], data.qpos)
        mujoco.mj_step(model, data)
        assert np.array_equal(after.qpos[0], data.qpos)
        data.qfrc_applied[:], data.xfrc_applied[:] = 0.0, 0.0
        mujoco.mj_step(model, data)
        assert np.array_equal(after.qpos[1], data.qpos)
    with pytest.raises(UnknownNameError, match="unknown body 'no'; valid choices: a, b"):
        reservoir.rollout(5, forces={"no": (0, 0, 1)})


def test_copies_may_be_pushed_differently():
    pushes = np.array([[1.0, 2.0, -3.0], [0.0, -1.0, 0.5]])
    both = Reservoir(ARM, sensors="q1", channels=["m1"], copies=2)
    run = both.rollout(500, forces={"b": pushes}, record=("qpos",))
    for copy, push in enumerate(pushes):
        alone = Reservoir(ARM, sensors="q1", channels=["m1"])
        wanted = alone.rollout(500, forces={"b": push}, record=("qpos",))
        assert np.array_equal(run.qpos[copy], wanted.qpos)
    with pytest.raises(InvalidArgumentError, match=r"forces on b: expected shape \(2, 3\)"):
        both.rollout(5, forces={"b": np.zeros((3, 3))})


def test_a_heavier_body_and_a_cut_tendon_are_another_model():
    soft = ARM.replace('<spatial name="t">', '<spatial name="t" stiffness="30" damping="1">')
    reservoir = Reservoir(soft, sensors="q1", channels=["m1"])
    mass = float(reservoir.model.body("b").mass[0])
    reservoir.alter(cut=("t",), masses={"b": 2 * mass})
    run = reservoir.rollout(500, record=("qpos",))
    spec = mujoco.MjSpec.from_string(ARM)
    spec.body("b").geoms[0].density *= 2
    data = mujoco.MjData(model := spec.compile())
    mujoco.mj_step(model, data, 499)
    assert np.abs(run.qpos[-1] - data.qpos).max() < 1e-14
    for damage in ({"cut": ("no",)}, {"masses": {"no": 1.0}}):
        with pytest.raises(UnknownNameError, match=r"unknown (tendon|body) 'no'"):
            reservoir.alter(**damage)


def test_copies_of_a_reservoir_begin_anywhere_and_may_be_left_behind():
    """Each as it is alone, bit for bit, beside one that blows up."""
    reservoir = driven("RK4")[0]
    rng, model = np.random.default_rng(1), reservoir.model
    qpos, qvel = 0.1 * rng.standard_normal((3, model.nq)), rng.standard_normal((3, model.nv))
    act = 0.1 * rng.standard_normal((3, model.na))
    qvel[1] = 1e12
    copies = reservoir.with_copies(3, threads=2, lenient=True)
    copies.restart(qpos, qvel, act)
    assert (copies.qvel == qvel).all()
    assert (copies.act == act).all()
    run = copies.rollout(500)
    assert copies.alive.tolist() == [True, False, True]
    copies.rollout(5)
    assert copies.alive.tolist() == [True, False, True]
    for copy in (0, 2):
        reservoir.rollout(7)
        reservoir.restart(qpos[copy], qvel[copy], act[copy])
        assert (reservoir.rollout(500).signals == run.signals[copy]).all()
    copies.reset()
    assert copies.alive.all()
    strict = reservoir.with_copies(2)
    strict.restart(qpos[:2], qvel[:2])
    with pytest.raises(McmjError, match="copy 1: the simulation blew up"):
        strict.rollout(500)
    with pytest.raises(InvalidArgumentError, match="act"):
        copies.restart(act=np.zeros(99))


def test_the_twin_leaves_nothing_behind(body):
    twin = mcmj.Simulation(body, engine="twin")
    assert twin.with_copies(2).alive.tolist() == [True, True]
    with pytest.raises(InvalidArgumentError, match="lenient"):
        twin.with_copies(2, lenient=True)


def test_mujoco_writes_the_model_that_it_compiled_last_only():
    """Bodies, and what mcmj compiles beside, do not come between."""
    model = mujoco.MjModel.from_xml_string(ARM)
    mcmj.Simulation(mcmj.random_body(0)).rollout(5)
    Reservoir(ARM, sensors="q1", channels=["m1"]).rollout(5)
    assert Reservoir(model, sensors="q1", channels=["m1"]).rollout(5).signals.shape == (5, 1)
    mujoco.MjModel.from_xml_string("<mujoco/>")
    with pytest.raises(BodyFileError, match="MuJoCo does not write this MjModel as MJCF"):
        Reservoir(model, sensors="q1", channels=["m1"])
