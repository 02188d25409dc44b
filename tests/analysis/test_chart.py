"""The chart of a state: there and back, MuJoCo's own differences, yaw."""

import mujoco
import numpy as np
import pytest

from mcmj.analysis.loops.chart import Chart

JOINTS = """<mujoco><worldbody>
<body quat=".8 .1 -.3 .5"><freejoint name="f"/><geom size=".1"/>
 <body pos=".3 0 0"><joint name="b" type="ball"/><geom size=".1"/>
  <body pos=".3 0 0"><joint name="h" axis="0 1 0"/><joint name="s" type="slide"/>
  <geom size=".1"/></body></body></body></worldbody>
<actuator><general name="m" joint="h" dyntype="filter" dynprm=".1"/></actuator></mujoco>"""


@pytest.fixture(scope="module")
def chart():
    model = mujoco.MjModel.from_xml_string(JOINTS)
    return Chart(model, mujoco.MjData(model).qpos.copy()), model


def test_a_chart_goes_there_and_back(chart):
    one, _ = chart
    z = 0.8 * np.random.default_rng(0).standard_normal((50, one.size))
    np.testing.assert_allclose(one.coordinates(*one.state(z)), z, atol=1e-13)
    assert one.size == 2 * 11 + 1
    assert one.names[:6] == ("f:x", "f:y", "f:z", "f:swing_x", "f:swing_y", "f:yaw")
    assert one.names[6:] == ("b:x", "b:y", "b:z", "h", "s")
    assert sorted(np.concatenate(list(one.groups()))) == list(range(23))


def test_balls_hinges_and_slides_are_as_mujoco_has_them(chart):
    one, model = chart
    z = np.random.default_rng(1).standard_normal((20, one.size))
    for row, qpos in zip(z, one.state(z)[0], strict=True):
        dq = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, dq, 1.0, one.reference, qpos)
        np.testing.assert_allclose(row[6 : model.nv], dq[6:], atol=1e-13)
        np.testing.assert_allclose(row[:3], dq[:3], atol=1e-13)


def test_a_turn_about_the_vertical_is_yaw_and_nothing_else(chart):
    one, _ = chart
    z = np.random.default_rng(2).standard_normal((20, one.size))
    qpos, qvel, act = one.state(z)
    turn = np.array([np.cos(0.35), 0.0, 0.0, np.sin(0.35)])
    for row in range(len(z)):
        mujoco.mju_mulQuat(qpos[row, 3:7], turn, qpos[row, 3:7].copy())
        mujoco.mju_rotVecQuat(qvel[row, :3], qvel[row, :3].copy(), turn)
    z[:, 5] += 0.7
    np.testing.assert_allclose(one.coordinates(qpos, qvel, act), z, atol=1e-13)
