"""Models that nobody of us wrote, under our callbacks: no jump, no read out of bounds.

Each runs in a process of its own, which a broken callback would kill.
"""

import json
import subprocess
import sys

import pytest

import mcmj
from mcmj.core.callbacks.pointers import COUPLED_TAG, TAG
from mcmj.mjcf.read import load_model
from mcmj.utils.errors import BodyFileError

BODY = mcmj.random_body(0, 5)
READOUT = mcmj.to_mjcf(BODY, w_out=[[1.0, 1.0]] * (BODY.n_springs + 1))

# a process in which every callback is at work, with a law of one spring and a law of all
CALLBACKS = """
import json, sys, mujoco, numpy as np, mcmj
from mcmj.core.callbacks.coupled_laws import CoupledLaw
body = mcmj.random_body(0, 5)
def all_springs(x1, x2, parameters, out):
    for j in range(out.size):
        out[j] = parameters[j, 0] * x1[j]
sims = [mcmj.Simulation(body, integrator="leapfrog"), mcmj.Simulation(body, springs="tansig"),
        mcmj.Simulation(body, springs=CoupledLaw("all_springs", all_springs))]
keys = [sim.model.numeric('springs').data[5] for sim in sims[1:]]
"""
RUN = """
for name, text in json.load(sys.stdin).items():
    print(name, end=" ", flush=True)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 3)
    print(data.qfrc_passive.any() or data.qfrc_actuator.any())
"""
OWN_KEYS = """
text = sys.stdin.read()
for tag in (20120595.0, 20120595.5):
    for key in keys:
        model = mujoco.MjModel.from_xml_string(text)
        springs = model.tendon_user[:, 0] != 0
        model.tendon_user[springs, 0], model.tendon_user[springs, 1] = tag, key
        data = mujoco.MjData(model)
        data.qpos[:] = 0.01 * np.arange(model.nv)
        mujoco.mj_step(model, data)
        print(data.qfrc_passive.any())
"""
# a body's table of springs with numbers that do not fit, then its memory, sensors and channels
TABLES = """
import dataclasses
from mcmj.core.callbacks.spring_table import HEAD, NODE
from mcmj.core.options import Options
from mcmj.mjcf.without_tendons import model_without_tendons
from mcmj.mjcf.write import to_mjcf
body, rng = dataclasses.replace(body), np.random.default_rng(0)
options = Options(feedback_delay=2, integrator="leapfrog", springs="tansig")
bad = [-1.0, -2.0, 0.5, 3.0, 1e3, 1e9, 2.0**31, 1e300, -1e300, np.nan, np.inf, -np.inf, 2.0**53]
places = [*range(1, HEAD + NODE * body.n_nodes), *range(-8 * body.n_springs, -6 * body.n_springs)]
def runs(model):
    data = mujoco.MjData(model)
    data.qpos[:] = 0.01 * np.arange(model.nv)
    mujoco.mj_step(model, data, 3)
    mujoco.mj_forward(model, data)
    return bool(data.qfrc_passive.any())
print("whole", runs(model_without_tendons(body, options)))
for place in places:
    for value in bad:
        model = model_without_tendons(body, options)
        model.numeric("springs").data[place] = value
        runs(model)
block = model_without_tendons(body, options).numeric("springs").data.copy()
for userdata, sensors, joints in ((0, 0, 0), (10, 3, 2), (500, 40, 9), (3, 8, 6)):
    spec = mujoco.MjSpec()
    spec.nuserdata = userdata
    spec.add_numeric(name="springs", data=block)
    spec.add_numeric(name="leapfrog", data=[20120595.0])
    node = spec.worldbody
    for _ in range(joints):
        node = node.add_body(mass=1.0, inertia=np.ones(3), explicitinertial=True)
        node.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE)
    if sensors:
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_USER, dim=sensors,
                        needstage=mujoco.mjtStage.mjSTAGE_POS)
    runs(spec.compile())
    print(userdata)
"""
READOUTS = [
    ("1e9", "5"), ("-1e9", "5"), ("0", "1e9"), ("0", "-3"), ("1e300", "1"), ("2", "1e15"),
    ("-1", str(BODY.n_springs)),
]  # fmt: skip


def in_a_process(code: str, stdin: str) -> list[str]:
    """The lines that the code prints under our callbacks."""
    command = [sys.executable, "-W", "ignore", "-c", CALLBACKS + code]
    done = subprocess.run(command, input=stdin, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout.split("\n")[:-1]


def springs_with(tag: float, key: str) -> str:
    text = mcmj.to_mjcf(BODY, springs="tansig")
    assert f'user="{TAG!r} 0.0' in text
    return text.replace(f'user="{TAG!r} 0.0', f'user="{tag!r} {key}')


def readout_with(first: str, count: str) -> str:
    old = f"1.0 {TAG!r} 0.0 {float(BODY.n_springs)!r}"
    assert old in READOUT
    return READOUT.replace(old, f"1.0 {TAG!r} {first} {count}")


def test_no_file_makes_a_callback_jump():
    """Neither an address (its bits as a subnormal) nor a guessed key calls anything."""
    keys = ("0x414141414140p-1074", "0x1p-1035", "1", "4097", "-1", "1e300")
    texts = {f"{tag}/{key}": springs_with(tag, key) for tag in (TAG, COUPLED_TAG) for key in keys}
    assert in_a_process(RUN, json.dumps(texts)) == [f"{name} False" for name in texts]


def test_a_law_is_called_only_by_springs_that_it_was_made_for():
    """Even with a key of this process: the kind of law and the number of springs must fit."""
    own = in_a_process(OWN_KEYS, springs_with(TAG, "0"))
    assert own == ["True", "False", "False", "True"]
    larger = mcmj.to_mjcf(mcmj.random_body(0, 9), springs="tansig")
    assert in_a_process(OWN_KEYS, larger) == ["True", "False", "False", "False"]


def test_no_table_of_springs_can_harm():
    """Every number of its head and every index wrong, in models of other sizes too."""
    assert in_a_process(TABLES, "") == ["whole True", "0", "10", "500", "3"]


def test_a_readout_outside_the_sensors_is_ignored():
    texts = {f"{first}/{count}": readout_with(first, count) for first, count in READOUTS}
    assert in_a_process(RUN, json.dumps(texts)) == [f"{name} False" for name in texts]
    inside = {"inside": readout_with("1", "3")}
    assert in_a_process(RUN, json.dumps(inside)) == ["inside True"]


@pytest.mark.parametrize(("first", "count"), READOUTS)
def test_and_refused_where_a_file_is_read(first, count):
    text = readout_with(first, count)
    with pytest.raises(BodyFileError, match="actuator 'fb0': its readout reads"):
        load_model(text)
    with pytest.raises(BodyFileError, match="actuator 'fb0'"):
        mcmj.from_mjcf(text)
