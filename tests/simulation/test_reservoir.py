"""Any model as a reservoir: signals, outputs and controls agree with a plain Python loop."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest
from models import ARM, ARM_CHANNELS, T, driven

import mcmj
from mcmj import Reservoir
from mcmj.core.callbacks import install
from mcmj.metrics.orbits import orbit_error
from mcmj.utils.errors import (
    BodyFileError,
    DivergenceError,
    InvalidArgumentError,
    McmjError,
    UnknownNameError,
)

INTEGRATORS = ["Euler", "RK4", "implicit", "implicitfast"]


def python_loop(reservoir, w_out, gate, offset, inputs):
    """The law by hand, on the reservoir's own model without our callback."""
    model = mujoco.MjModel.from_xml_string(ARM.replace("<sensor>", "<sensor>"))
    model.opt.integrator, model.opt.timestep = (
        reservoir.model.opt.integrator,
        reservoir.model.opt.timestep,
    )
    data = mujoco.MjData(model)
    late = np.zeros(4)
    signals, outputs, controls = [], [], []
    joint, tendon = model.joint("j3").qposadr[0], 0
    for k in range(len(offset)):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_sensorPos(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_sensorVel(model, data)
        s = np.r_[
            data.sensor("q1").data, data.sensor("tip").data, late[:3], data.sensor("v2").data,
            late[3], data.qpos[joint], data.ten_length[tendon],
        ]  # fmt: skip
        y = s @ w_out[:-1] + w_out[-1]
        drive = gate * y + offset[k]
        data.ctrl[:] = 0.0
        for value, gains in zip(drive, ARM_CHANNELS.values(), strict=True):
            for name, gain in gains.items():
                data.ctrl[model.actuator(name).id] += gain * value
        data.ctrl[model.actuator("free").id] += inputs[k, 0]
        signals.append(s)
        outputs.append(y)
        controls.append(data.ctrl.copy())
        if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            mujoco.mj_forward(model, data)
            late = np.r_[data.sensor("acc").data, data.sensor("frc").data].copy()
            mujoco.mj_step(model, data)
        else:
            mujoco.mj_step(model, data)
            late = np.r_[data.sensor("acc").data, data.sensor("frc").data].copy()
    return np.array(signals), np.array(outputs), np.array(controls), data.qpos.copy()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_signals_and_outputs_agree_with_a_plain_loop(integrator):
    reservoir, w_out, gate, offset, inputs = driven(integrator)
    assert reservoir.signal_names[1:4] == ("tip[0]", "tip[1]", "tip[2]")
    reservoir.set_readout(w_out)
    run = reservoir.rollout(inputs=inputs, offset=offset, gate=gate, record=("signals", "outputs"))
    signals, outputs, _, _ = python_loop(reservoir, w_out, gate, offset, inputs)
    assert np.abs(run.signals - signals).max() < 1.5e-14 * np.abs(signals).max()
    assert np.abs(run.outputs - outputs).max() < 1.5e-14 * np.abs(outputs).max()


def test_chunks_snapshots_and_a_second_run_are_the_same_bits():
    reservoir, w_out, gate, offset, inputs = driven("implicitfast")
    reservoir.set_readout(w_out)
    whole = reservoir.rollout(inputs=inputs, offset=offset, gate=gate, record=("signals", "qpos"))
    reservoir.reset()
    parts = list(reservoir.stream(inputs=inputs, offset=offset, gate=gate, chunk=700))
    assert np.array_equal(np.concatenate([part.signals for part in parts]), whole.signals)
    reservoir.reset()
    reservoir.rollout(inputs=inputs[:1000], offset=offset[:1000], gate=gate)
    snapshot = reservoir.snapshot()
    reservoir.rollout(500)
    reservoir.restore(snapshot)
    rest = reservoir.rollout(inputs=inputs[1000:], offset=offset[1000:], gate=gate)
    assert np.array_equal(rest.signals, whole.signals[1000:])
    assert reservoir.time == pytest.approx(T * 0.002)
    with pytest.raises(InvalidArgumentError, match="snapshot: expected one of this model"):
        Reservoir(ARM, sensors="q1", channels=["m1"]).restore(snapshot)


def test_a_second_drive_in_mid_stream_is_refused():
    reservoir = Reservoir(ARM, sensors="q1", channels=["m1"], w_out=np.array([[-1.0]]))
    stream = reservoir.stream(100, chunk=10)
    next(stream)
    with pytest.raises(McmjError, match="not at its end"):
        reservoir.rollout(10, gate=0.0)
    stream.close()
    assert len(reservoir.rollout(10)) == 10


def test_a_delay_feeds_back_what_was():
    late = Reservoir(ARM, sensors=["q1", "jointvel:j1"], channels=["m1"], feedback_delay=3)
    w_out = np.array([[-0.5], [-0.1], [0.3]])
    late.set_readout(w_out)
    offset = np.ones((200, 1))
    run = late.rollout(offset=offset)
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    seen = []
    for k in range(200):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        seen.append([data.qpos[0], data.qvel[0]])
        y = (np.array(seen[k - 3]) @ w_out[:2] + w_out[2])[0] if k >= 3 else 0.0
        data.ctrl[model.actuator("m1").id] = y + 1.0
        mujoco.mj_step(model, data)
    assert np.abs(run.signals - seen).max() < 1e-14  # 0 here


def test_a_body_is_the_same_as_a_reservoir_and_as_a_simulation(body, w_bias):
    simulation = mcmj.Simulation(body, w_out=w_bias, integrator="Euler")
    channels = [f"y{c}" for c in range(body.n_outputs)]
    xml = mcmj.to_mjcf(body)
    names = [a.name for a in mujoco.MjSpec.from_string(xml).actuators][body.n_inputs :]
    spec = mujoco.MjSpec.from_string(xml)
    for name in names:  # its own law is taken out
        spec.actuator(name).biastype = mujoco.mjtBias.mjBIAS_NONE
    reservoir = Reservoir(
        spec, sensors="*",
        channels={c: {n: 1.0} for c, n in zip(channels, names, strict=True)}, w_out=w_bias,
    )  # fmt: skip
    one, other = simulation.rollout(2000), reservoir.rollout(2000)
    assert np.abs(one.lengths - other.signals).max() < 1e-13  # 0 here: lengths of some 10 m


@pytest.mark.parametrize("read", [str, mujoco.MjModel.from_xml_string])
@pytest.mark.parametrize("installed", [False, True])
def test_a_file_of_leapfrog_is_euler_as_a_reservoir(body, w_out, installed, read):
    install.uninstall()
    install.install(passive=installed)
    one, other = (
        Reservoir(
            read(mcmj.to_mjcf(body, integrator=integrator)),
            sensors="length*", channels="fb*", inputs="in*", w_out=w_out,
        )
        for integrator in ("leapfrog", "Euler")
    )  # fmt: skip
    inputs = np.random.default_rng(0).normal(size=(100, 2))
    signals = [run.rollout(inputs=inputs).signals for run in (one, other)]
    assert np.ptp(signals[0], axis=0).max() > 1e-3
    assert np.array_equal(*signals)


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"model": "nowhere.xml"}, BodyFileError, "model: "),
        ({"model": "<mujoco><nix/></mujoco>"}, BodyFileError, "model: "),
        ({"sensors": "nix*"}, UnknownNameError, r"unknown sensor 'nix\*'; valid choices: acc"),
        ({"sensors": "jointpos:no"}, UnknownNameError, "unknown joint"),
        ({"sensors": ()}, InvalidArgumentError, "sensors: expected at least one sensor"),
        ({"channels": ["no"]}, UnknownNameError, "unknown actuator of channels 'no'"),
        ({"channels": {"y": {"no": 1.0}}}, UnknownNameError, "unknown actuator of channel y"),
        ({"channels": {}}, InvalidArgumentError, "channels: expected at least one"),
        ({"timestep": -1.0}, InvalidArgumentError, "timestep: "),
        ({"integrator": "Verlet"}, UnknownNameError, "unknown integrator 'Verlet'"),
        ({"w_out": np.zeros((2, 2))}, InvalidArgumentError, "w_out: "),
    ],
)
def test_what_a_model_has_not_is_named(changes, error, text):
    mujoco.MjModel.from_xml_string("<mujoco/>")  # the last one that MuJoCo can write
    given = {"model": ARM, "sensors": "q1", "channels": ["m1"]} | changes
    with pytest.raises(error, match=text):
        Reservoir(given.pop("model"), **given)


def test_a_run_that_blows_up_names_the_joint():
    reservoir = Reservoir(ARM, sensors="jointvel:*", channels=["free"], w_out=np.full((3, 1), 1e6))
    with pytest.raises(DivergenceError, match=r"blew up after t = .* at joint") as caught:
        reservoir.rollout(20_000, offset=np.ones((20_000, 1)))
    assert caught.value.steps_done == pytest.approx(caught.value.time / 0.002)
    assert 1 < caught.value.steps_done < 20_000


def test_a_chain_of_masses_learns_a_rhythm_through_its_own_sensors_and_motors():
    links = 12
    body = "<body pos='.1 0 0'><joint name='j{0}' axis='0 0 1' damping='.02' stiffness='{1}'/>"
    body += "<geom type='capsule' fromto='0 0 0 .1 0 0' size='.02' mass='.1'/>"
    rng = np.random.default_rng(0)
    chain = "".join(body.format(i, rng.uniform(0.5, 4.0)) for i in range(links))
    motors = "".join(f"<motor name='m{i}' joint='j{i}'/>" for i in range(links))
    xml = (
        "<mujoco><option timestep='.002' gravity='0 0 0' integrator='implicitfast'/><worldbody>"
        f"{chain}{'</body>' * links}</worldbody><actuator>{motors}</actuator></mujoco>"
    )
    channels = {
        name: {f"m{i}": 0.3 * rng.uniform(-1, 1) for i in range(links)} for name in ("x1", "x2")
    }
    reservoir = Reservoir(xml, sensors=["jointpos:*", "jointvel:*"], channels=channels)
    goal = mcmj.target("van_der_pol")
    teaching = mcmj.Teaching(duration=60.0, noise=0.2, bias=True, ridge_per_row=1e-10)
    fit = mcmj.teach(reservoir, goal, teaching, seed=0)
    assert fit.train_nrmse < 0.05
    outputs = reservoir.rollout(20_000, record=("outputs",)).outputs
    assert orbit_error(outputs[-7000:], goal) < 0.05


HOSTILE = """
import mujoco, numpy as np
from mcmj.core.callbacks import install
from mcmj.core.callbacks.reservoir_law import RESERVOIR_TAG, Law, block
install.install_control()
rng = np.random.default_rng(0)
good = block(Law(1, 1, 2, 2, 1, 1, 0), [0, 1], [1], [(0, 0, 1.0)], 0.0)
bad = [np.nan, np.inf, -1.0, 0.5, 1e9, 1e300, -1e300, 2.0**63, 3.0, 0.0]
for case in range(400):
    values = list(good)
    for place in rng.integers(1, len(good), size=rng.integers(1, 4)):
        values[place] = bad[rng.integers(len(bad))]
    if case % 5 == 0:
        values = values[: rng.integers(1, len(good))]
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody>"
        "<actuator><motor joint='j'/><motor joint='j'/></actuator>"
        "<sensor><jointpos joint='j'/><jointvel joint='j'/><clock/></sensor></mujoco>"
    )
    spec.nuser_actuator, spec.nuserdata = 3, case % 4
    numeric = spec.add_numeric(name="n", data=[0.0] * len(values), size=len(values))
    model = spec.compile()
    model.numeric_data[:] = values  # also what MuJoCo's compiler would refuse
    mujoco.mj_step(model, mujoco.MjData(model), 3)
print("alive")
"""


def test_a_hostile_model_cannot_harm(tmp_path):  # MuJoCo writes a log where it runs
    command = [sys.executable, "-c", HOSTILE]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout == "alive\n", done.stderr


def test_a_delay_with_late_sensors_is_the_same_in_chunks_and_snapshots():
    rng = np.random.default_rng(0)
    given = {"sensors": ["q1", "acc", "frc"], "channels": ARM_CHANNELS, "feedback_delay": 3}
    whole = Reservoir(ARM, **given)
    w_out = 0.02 * rng.normal(size=(whole.n_signals + 1, 3))
    offset = np.cumsum(rng.normal(size=(300, 3)), axis=0) / 10
    whole.set_readout(w_out)
    run = whole.rollout(offset=offset)
    parts = Reservoir(ARM, **given, w_out=w_out)
    first = [part.signals for part in parts.stream(offset=offset[:200], chunk=7)]
    snapshot = parts.snapshot()
    parts.rollout(50)
    parts.restore(snapshot)
    rest = parts.rollout(offset=offset[200:]).signals
    assert np.array_equal(np.concatenate([*first, rest]), run.signals)
    # a delayed accelerometer is heard four steps late: three, and the one of its own
    data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(ARM))
    seen = []
    for k in range(299):
        seen.append(np.r_[data.qpos[0], run.signals[k, 1:]])
        y = seen[k - 3] @ w_out[:-1] + w_out[-1] if k >= 3 else np.zeros(3)
        drive, data.ctrl[:] = y + offset[k], 0.0
        for value, gains in zip(drive, ARM_CHANNELS.values(), strict=True):
            for name, gain in gains.items():
                data.ctrl[model.actuator(name).id] += gain * value
        mujoco.mj_step(model, data)
        assert np.abs(data.sensor("acc").data - run.signals[k + 1, 1:4]).max() < 4e-13


def test_defaults_of_a_model_are_not_those_of_its_channels():
    """Limits, dynamics and forces of a default are for the model's own actuators."""
    default = (
        '<default><general ctrllimited="true" ctrlrange="-.1 .1" dyntype="filter" dynprm="1" '
        'forcelimited="true" forcerange="-1 1"/></default>'
    )
    xml = ARM.replace("<worldbody>", f"{default}<worldbody>")
    reservoir = Reservoir(xml, sensors="q1", channels=["m1"])
    offset = np.sin(0.01 * np.arange(500))[:, None]
    run = reservoir.rollout(offset=offset, record=("qpos",))
    data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(xml))
    for k in range(499):
        data.ctrl[model.actuator("m1").id] = offset[k, 0]
        mujoco.mj_step(model, data)
    assert np.array_equal(run.qpos[-1], data.qpos)
    assert np.abs(data.qpos[0]) > 0.1


KINDS = """
<mujoco><option timestep="0.002"/><worldbody>
  <body name="a" pos="0 0 1"><joint name="j1" axis="0 1 0" damping="2" stiffness="20"/>
    <geom type="capsule" fromto="0 0 0 .4 0 0" size=".04"/><site name="tip_a" pos=".4 0 0"/>
    <body name="b" pos=".4 0 0"><joint name="j2" type="ball" damping="1" stiffness="10"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><site name="tip" pos=".3 0 .1"/>
    </body></body>
  <site name="wall" pos="0.5 0 1.4"/></worldbody>
<tendon><spatial name="t" stiffness="5" springlength="0"><site site="wall"/><site site="tip"/>
  </spatial></tendon>
<actuator>
  <motor name="site" site="tip" gear="0 0 1 0 .1 0" ctrlrange="-.5 .5" ctrllimited="true"/>
  <motor name="between" site="tip" refsite="wall" gear="1 0 0 0 0 0"/>
  <position name="pull" tendon="t" kp="20" forcerange="-2 2" forcelimited="true"/>
  <velocity name="rate" joint="j1" kv="3"/>
  <muscle name="muscle" tendon="t" force="5" lengthrange=".1 .6"/>
  <general name="exact" joint="j1" dyntype="filterexact" dynprm=".02" gainprm="2" biastype="affine"
   biasprm=".1 -1 -.2"/>
  <general name="sum" joint="j1" dyntype="integrator" gainprm="1" actlimited="true"
   actrange="-.3 .3"/>
  <motor name="ball" joint="j2" gear=".2 .1 -.3"/>
</actuator>
<sensor><ballquat name="quat" joint="j2"/><ballangvel name="spin" joint="j2"/>
  <tendonpos name="length" tendon="t"/><velocimeter name="speed" site="tip"/>
  <actuatorfrc name="force" actuator="muscle"/></sensor></mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast", "discrete"])
def test_every_kind_of_actuator_is_driven_as_by_hand(integrator):
    """Motors, servos, muscles, integrators, filters; on joints, balls, tendons and sites."""
    spec = mujoco.MjSpec.from_string(KINDS)
    names = [actuator.name for actuator in spec.actuators]
    rng = np.random.default_rng(2)
    gains = rng.uniform(-1.0, 1.0, (2, len(names)))
    channels = {f"y{c}": dict(zip(names, row.tolist(), strict=True)) for c, row in enumerate(gains)}
    step = 2e-4 if integrator == "RK4" else 2e-3  # dampers are stiff
    reservoir = Reservoir(
        KINDS, sensors="*", channels=channels, integrator=integrator, timestep=step
    )
    w_out = 0.02 * rng.normal(size=(reservoir.n_signals + 1, 2))
    offset = np.cumsum(rng.normal(size=(T, 2)), axis=0) / np.sqrt(T)
    reservoir.set_readout(w_out)
    run = reservoir.rollout(offset=offset, record=("signals", "outputs", "qpos"))
    spec.option.integrator, spec.option.timestep = reservoir.model.opt.integrator, step
    data = mujoco.MjData(model := spec.compile())
    late = np.zeros(1)
    for k in range(T):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_sensorPos(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_sensorVel(model, data)
        signals = np.r_[data.sensordata[:-1], late]
        outputs = signals @ w_out[:-1] + w_out[-1]
        # an ulp or none here; sums in another order, as on another processor, grow with the steps
        assert np.abs(run.qpos[k] - data.qpos).max() < 2e-14
        assert np.abs(run.signals[k] - signals).max() < 1e-13
        assert np.abs(run.outputs[k] - outputs).max() < 2e-14
        data.ctrl[:] = (outputs + offset[k]) @ gains
        if integrator == "RK4":
            mujoco.mj_forward(model, data)
            late = data.sensordata[-1:].copy()
        mujoco.mj_step(model, data)
        if integrator != "RK4":
            late = data.sensordata[-1:].copy()
    assert np.abs(np.diff(run.qpos, axis=0)).max() > 1e-4
