"""Body -> MJCF: nothing superfluous, readable by others, and arguments checked."""

import json
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from mcmj import to_mjcf
from mcmj.core.integrators import INTEGRATORS
from mcmj.mjcf.read import load_model
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast", "discrete"])
def test_nothing_superfluous_in_the_model(body, w_out, integrator):
    model = load_model(to_mjcf(body, w_out=w_out, timestep=5e-4, integrator=integrator))
    free = body.n_nodes - 2
    assert model.nv == model.nq == model.njnt == 2 * free
    assert model.nbody == 1 + free
    assert model.nsite == body.n_nodes
    assert model.ntendon == body.n_springs + body.n_inputs + body.n_outputs
    assert model.nsensor == body.n_springs
    assert model.nu == body.n_inputs + body.n_outputs
    assert model.na == model.ngeom == model.neq == model.nmesh == model.nkey == 0
    assert not model.opt.gravity.any()
    for flag in (mujoco.mjtDisableBit.mjDSBL_CONTACT, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT):
        assert model.opt.disableflags & flag
    assert model.opt.timestep == 5e-4
    assert mujoco.mjtIntegrator(model.opt.integrator).name.lower() == f"mjint_{integrator}".lower()
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0
    mujoco.mj_step(model, data)
    assert data.ncon == data.nefc == 0


def test_readout_lives_in_the_feedback_actuators(body, w_bias):
    """The contract of design.md, section 2: weights in user data, gate in biasprm[0]."""
    model = load_model(to_mjcf(body, w_out=w_bias))
    for channel in range(body.n_outputs):
        actuator = model.actuator(f"fb{channel}")
        assert np.array_equal(actuator.user, w_bias[:, channel])
        assert actuator.biastype[0] == mujoco.mjtBias.mjBIAS_USER
        assert actuator.biasprm[0] == 1.0
        assert actuator.gainprm[0] == 1.0
    opened = load_model(to_mjcf(body))
    assert opened.actuator("fb0").biasprm[0] == 0.0


def test_sensors_measure_the_springs_at_the_start(body):
    model = load_model(to_mjcf(body))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.sensordata == pytest.approx(body.rest_lengths, rel=1e-15)


def test_colours_follow_the_paper(body):
    model = load_model(to_mjcf(body))
    for node in range(body.n_nodes):
        r, g, b, _ = model.site(f"n{node}").rgba
        kind = model.site(f"n{node}").type[0]
        if body.fixed[node]:
            assert kind == mujoco.mjtGeom.mjGEOM_BOX
            assert r > 0.8 > 0.2 > max(g, b)
        elif body.w_fb[node].any():
            assert b > g or g > r  # purple or aqua
        elif body.w_in[node].any():
            assert g > max(r, b)
        else:
            assert r == g == b


def test_steps_in_dm_control_as_in_mujoco(body):
    dm_mujoco = pytest.importorskip("dm_control.mujoco")
    text = to_mjcf(body, integrator="Euler")
    physics = dm_mujoco.Physics.from_xml_string(text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    controls = np.random.default_rng(0).normal(size=(200, model.nu))
    for control in controls:
        physics.set_control(control)
        data.ctrl[:] = control
        physics.step()
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos).max() > 1e-3
    assert physics.data.qpos.tobytes() == data.qpos.tobytes()
    assert physics.data.qvel.tobytes() == data.qvel.tobytes()


def test_unknown_integrator_lists_the_names(body):
    with pytest.raises(UnknownNameError, match="'rk45'") as caught:
        to_mjcf(body, integrator="rk45")
    assert caught.value.choices == sorted(INTEGRATORS)
    for name in INTEGRATORS:
        assert name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timestep", 0.0),
        ("timestep", np.nan),
        ("feedback_delay", -1e-3),
        ("control_period", np.inf),
        ("w_out", np.zeros((3, 2))),
        ("w_out", [1.0, 2.0]),
    ],
)
def test_bad_arguments_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        to_mjcf(body, **{name: value})
    assert caught.value.name == name


def test_wrong_readout_names_both_shapes(body):
    n = body.n_springs
    with pytest.raises(InvalidArgumentError) as caught:
        to_mjcf(body, w_out=np.zeros((n - 1, 2)))
    assert str(caught.value) == (
        f"w_out: expected {n} rows (or {n + 1} with a bias), got shape ({n - 1}, 2)"
    )
    with pytest.raises(InvalidArgumentError, match=r"^mine: "):
        to_mjcf(body, readouts={"mine": np.full((n, 2), np.nan)})


def test_provenance_is_readable_without_mcmj(body):
    """It is plain JSON in a text element."""
    root = ET.fromstring(to_mjcf(body, provenance={"seed": 7, "by": 'a "name" & more'}))
    text = root.find("custom/text[@name='provenance']").get("data")
    assert json.loads(text) == {"seed": 7, "by": 'a "name" & more'}
