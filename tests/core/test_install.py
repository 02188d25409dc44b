"""The compiled callbacks: the right force at the right time, and nobody else's business."""

import mujoco
import numpy as np
import pytest
import twins
from models import CHAIN, CHAIN_PARTS

import mcmj
from mcmj import Simulation, to_mjcf
from mcmj.core.callbacks import install
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import McmjError

T = 400
RECORD = ("lengths", "outputs", "positions", "velocities")
# measured: at most 2e-13 m on lengths up to 80 m, 1e-13 m/s
SAME = {"lengths": 1e-12, "outputs": 1e-13, "positions": 1e-12, "velocities": 1e-12}
MUJOCO_S_OWN = ("Euler", "RK4", "implicit", "implicitfast", "discrete")
CALLBACKS = ("mjcb_act_bias", "mjcb_passive", "mjcb_sensor")


def assert_same(rollout, twin, tolerance=SAME):
    for name, limit in tolerance.items():
        assert np.abs(getattr(rollout, name) - getattr(twin, name)).max() < limit, name


@pytest.fixture
def no_callbacks():
    install.uninstall()
    for name in CALLBACKS:
        assert getattr(mujoco, f"get_{name}")() is None
    yield
    for name in CALLBACKS:
        getattr(mujoco, f"set_{name}")(None)


# --- the readout law -------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("bias", [False, True])
def test_closed_loop_follows_the_twin(body, w_out, w_bias, integrator, bias):
    readout = w_bias if bias else w_out
    rollout = Simulation(body, w_out=readout, integrator=integrator).rollout(T, record=RECORD)
    twin = twins.run(body, T, integrator=integrator, w_out=readout)
    assert np.ptp(twin.lengths, axis=0).max() > 0.1  # it moves
    assert np.ptp(twin.outputs, axis=0).max() > 1e-3
    assert_same(rollout, twin)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_the_whole_law_follows_the_twin(body, w_bias, integrator):
    """Gates, offsets, inputs and forces at once, none of them 0 or 1."""
    rng = np.random.default_rng(2)
    drive = {
        "gate": np.array([0.7, -1.3]),
        "offset": rng.normal(size=(T, body.n_outputs)),
        "inputs": rng.normal(size=(T, body.n_inputs)),
        "forces": 5 * rng.normal(size=(T, body.n_nodes)),
    }
    rollout = Simulation(body, w_out=w_bias, integrator=integrator).rollout(**drive, record=RECORD)
    assert_same(rollout, twins.run(body, T, integrator=integrator, w_out=w_bias, **drive))


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_feedback_is_the_output_held_over_the_step(body, w_bias, integrator, substeps):
    """Replayed as offsets with the loop open, the recorded outputs give the same motion.

    So what is fed back during step k is outputs[k], also in the stages of RK4.
    """
    options = {"integrator": integrator, "substeps": substeps}
    closed = Simulation(body, w_out=w_bias, **options).rollout(T, record=RECORD)
    replay = Simulation(body, **options).rollout(offset=closed.outputs, gate=0.0, record=RECORD)
    assert np.ptp(closed.outputs, axis=0).max() > 1e-3
    for name in ("lengths", "positions", "velocities"):
        assert np.abs(getattr(replay, name) - getattr(closed, name)).max() < 3e-13, name


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("substeps", [1, 4])
def test_lengths_are_those_before_the_step(body, w_out, integrator, substeps):
    simulation = Simulation(body, w_out=w_out, integrator=integrator, substeps=substeps)
    first, second = (simulation.rollout(50, record=RECORD) for _ in range(2))
    for part in (first, second):
        assert np.abs(part.lengths - twins.lengths_of(body, part.positions)).max() < 1e-13
    assert np.array_equal(first.positions[0], body.positions)
    assert np.array_equal(first.final_state.positions, second.positions[0])
    assert np.array_equal(first.final_state.velocities, second.velocities[0])
    assert np.abs(np.diff(first.lengths, axis=0)).max() > 1e-5  # a shift by a step would show


@pytest.mark.parametrize("integrator", MUJOCO_S_OWN)
def test_sensordata_after_mj_step_is_from_before_it(body, integrator):
    model = mujoco.MjModel.from_xml_string(to_mjcf(body, integrator=integrator))
    data = mujoco.MjData(model)
    data.qvel[:] = np.linspace(-1, 1, model.nv)
    for _ in range(20):
        positions = body.positions.copy()
        positions[body.free] += data.qpos.reshape(-1, 2)
        mujoco.mj_step(model, data)
        assert np.abs(data.sensordata - twins.lengths_of(body, positions)).max() < 1e-13


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_loop_is_closed_in_plain_mj_step(no_callbacks, body, w_bias, integrator):
    install.install()
    model = mujoco.MjModel.from_xml_string(to_mjcf(body, w_out=w_bias, integrator=integrator))
    data = mujoco.MjData(model)
    for _ in range(T):
        mujoco.mj_step(model, data)
    end, _ = twins.run(body, T, integrator=integrator, w_out=w_bias).end
    assert np.abs(data.qpos.reshape(-1, 2) - (end - body.positions)[body.free]).max() < 1e-12
    assert np.abs(data.qpos).max() > 0.01


def test_loop_is_open_without_the_callback(no_callbacks, body, w_bias):
    model = mujoco.MjModel.from_xml_string(to_mjcf(body, w_out=w_bias))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=50)
    assert not np.abs(data.qpos).max() > 1e-14


def test_a_gate_in_the_model_scales_the_loop(no_callbacks, body, w_bias):
    """biasprm[0] is the gate, also for someone who steps the model without mcmj."""
    install.install()
    model = mujoco.MjModel.from_xml_string(to_mjcf(body, w_out=w_bias))
    data = mujoco.MjData(model)
    model.actuator("fb1").biasprm[0] = -0.25
    mujoco.mj_forward(model, data)
    lengths = twins.lengths_of(body, body.positions)
    outputs = lengths @ w_bias[:-1] + w_bias[-1]
    assert data.actuator("fb0").force == pytest.approx(outputs[0], rel=1e-14)
    assert data.actuator("fb1").force == pytest.approx(-0.25 * outputs[1], rel=1e-14)


# --- good neighbours -------------------------------------------------------------------------

NEIGHBOUR = """
<mujoco>
  <option timestep="0.002"/>
  <size nuser_actuator="4" nuser_tendon="8"/>
  <worldbody>
    <site name="a"/>
    <body>
      <joint name="j" type="slide" stiffness="30" damping=".1"/>
      <geom size=".1"/><site name="b" pos="1 0 .5"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="t" stiffness="5" user="1 2 3 4 5 6 7 8">
      <site site="a"/><site site="b"/>
    </spatial>
  </tendon>
  <actuator>
    <general joint="j" biastype="user" biasprm="1 2 0 1" user="1 2 3 4"/>
    <motor joint="j"/>
  </actuator>
  <sensor><tendonpos tendon="t"/><jointvel joint="j"/></sensor>
</mujoco>"""


def run_neighbour():
    model = mujoco.MjModel.from_xml_string(NEIGHBOUR)
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.3, 0.4
    rows = []
    for _ in range(100):
        mujoco.mj_step(model, data)
        rows.append([*data.qpos, *data.qvel, *data.actuator_force, *data.qfrc_passive])
    return np.array(rows)


def test_other_models_run_as_if_we_were_not_there(no_callbacks, body, w_out):
    before = run_neighbour()
    install.install(passive=True, sensors=True)
    Simulation(body, w_out=w_out, springs="cubic").rollout(5)
    for name in CALLBACKS:
        assert getattr(mujoco, f"get_{name}")() is not None
    assert run_neighbour().tobytes() == before.tobytes()
    install.uninstall()
    assert run_neighbour().tobytes() == before.tobytes()


def test_two_bodies_in_one_process_do_not_mix(body, w_out, w_bias):
    other = mcmj.random_body(2, nodes=6)
    alone = Simulation(body, w_out=w_bias, springs="cubic").rollout(50)
    one = Simulation(body, w_out=w_bias, springs="cubic")
    two = Simulation(other, springs="tansig", timestep=5e-4)
    parts = []
    for _ in range(5):
        parts.append(one.rollout(10).lengths)
        two.rollout(10, forces=np.ones(6))
    assert np.concatenate(parts).tobytes() == alone.lengths.tobytes()


def test_install_is_idempotent(no_callbacks):
    install.install(passive=True, sensors=True)
    first = [getattr(mujoco, f"get_{name}")() for name in CALLBACKS]
    install.install()
    install.install(passive=True, sensors=True)
    assert all(getattr(mujoco, f"get_{n}")() is f for n, f in zip(CALLBACKS, first, strict=True))


def test_install_without_springs_leaves_their_callback_alone(no_callbacks):
    install.install()
    assert mujoco.get_mjcb_act_bias() is not None
    assert mujoco.get_mjcb_passive() is None
    assert mujoco.get_mjcb_sensor() is None


def test_uninstall_restores_none_and_may_be_repeated(no_callbacks):
    install.install(passive=True, sensors=True)
    for _ in range(2):
        install.uninstall()
        for name in CALLBACKS:
            assert getattr(mujoco, f"get_{name}")() is None


@pytest.mark.parametrize("name", CALLBACKS)
def test_a_foreign_callback_is_neither_replaced_nor_removed(no_callbacks, body, name):
    def foreign(model, data, *actuator):
        return 0.0

    getattr(mujoco, f"set_{name}")(foreign)
    with pytest.raises(McmjError, match=rf"another {name} is installed.*set_{name}\(None\)"):
        install.install(passive=True, sensors=True)
    with pytest.raises(McmjError, match=name):
        Simulation(body, springs="cubic")
    install.uninstall()
    assert getattr(mujoco, f"get_{name}")() is foreign
    getattr(mujoco, f"set_{name}")(None)
    install.install(passive=True, sensors=True)
    assert getattr(mujoco, f"get_{name}")() not in (None, foreign)


def test_a_simulation_reinstalls_what_was_uninstalled(body, w_bias):
    whole = Simulation(body, w_out=w_bias, springs="cubic").rollout(20).lengths
    simulation = Simulation(body, w_out=w_bias, springs="cubic")
    first = simulation.rollout(10).lengths
    install.uninstall()
    second = simulation.rollout(10).lengths
    assert np.concatenate([first, second]).tobytes() == whole.tobytes()


def take_out():
    for name in CALLBACKS:
        getattr(mujoco, f"set_{name}")(None)


LOOPS = [{}, {"springs": "cubic"}, {"integrator": "leapfrog"}, {"feedback_delay": 2}]


@pytest.mark.parametrize("options", LOOPS)
def test_callbacks_taken_out_in_mid_stream_are_installed_again(no_callbacks, body, w_bias, options):
    whole = Simulation(body, w_out=w_bias, **options).rollout(60, record=RECORD)
    parts = []
    for part in Simulation(body, w_out=w_bias, **options).stream(60, record=RECORD, chunk=20):
        parts.append(part)
        take_out()
        if len(parts) == 2:  # one whose callbacks are others
            Simulation(body, springs="cubic").rollout(5)
    for name in RECORD:
        pieces = np.concatenate([getattr(part, name) for part in parts])
        assert pieces.tobytes() == getattr(whole, name).tobytes(), name


def test_a_hook_may_take_callbacks_out(no_callbacks, body, w_bias):
    whole = Simulation(body, w_out=w_bias, springs="cubic").rollout(20).lengths

    def hook(time, lengths):
        take_out()
        return np.zeros(body.n_nodes)

    hooked = Simulation(body, w_out=w_bias, springs="cubic").rollout(20, hook=hook).lengths
    assert hooked.tobytes() == whole.tobytes()


def test_a_foreign_callback_in_mid_stream_is_refused(no_callbacks, body, w_bias):
    stream = Simulation(body, w_out=w_bias).stream(20, chunk=10)
    next(stream)
    mujoco.set_mjcb_act_bias(lambda model, data, actuator: 0.0)
    with pytest.raises(McmjError, match="another mjcb_act_bias is installed"):
        next(stream)


def test_any_model_installs_callbacks_that_were_taken_out(no_callbacks):
    w_out = np.random.default_rng(0).normal(size=(5, 2)) / 50
    runs = []
    for taken_out in (False, True):
        reservoir = mcmj.Reservoir(CHAIN, **CHAIN_PARTS, w_out=w_out)
        reservoir.set_state(qvel=[1.0, -2.0])
        parts = []
        for part in reservoir.stream(300, chunk=100):
            parts.append(part.signals)
            if taken_out:
                install.uninstall()
        runs.append(np.concatenate(parts))
    assert np.array_equal(*runs)
