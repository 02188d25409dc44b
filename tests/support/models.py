"""MuJoCo models that are no bodies of mcmj."""

import numpy as np

from mcmj import Reservoir

# a soft two-link chain that swings in a plane; two motors
CHAIN = """
<mujoco><option timestep="0.002" gravity="0 0 0" integrator="implicitfast"/><worldbody>
<body name="a"><joint name="j1" axis="0 0 1" damping=".05" stiffness="2"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/>
<body name="b" pos=".2 0 0"><joint name="j2" axis="0 0 1" damping=".02" stiffness="1"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/></body></body></worldbody>
<actuator><motor name="m1" joint="j1"/><motor name="m2" joint="j2"/></actuator></mujoco>"""
CHAIN_PARTS = {"sensors": ["jointpos:*", "jointvel:*"], "channels": ["m1", "m2"]}

# an arm with every stage of sensors, and motors, servos, filters and integrators
ARM = """
<mujoco><option timestep="0.002" gravity="0 0 -9.81"/>
<worldbody><geom type="plane" size="5 5 .1"/>
  <body name="a" pos="0 0 1"><joint name="j1" axis="0 1 0" damping="2" stiffness="20"/>
    <geom type="capsule" fromto="0 0 0 .4 0 0" size=".04"/><site name="tip_a" pos=".4 0 0"/>
    <body name="b" pos=".4 0 0"><joint name="j2" axis="0 1 0" damping="1" stiffness="10"/>
      <joint name="j3" axis="0 0 1" damping="1" stiffness="10"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><site name="tip" pos=".3 0 0"/>
    </body></body></worldbody>
<tendon><spatial name="t"><site site="tip_a"/><site site="tip"/></spatial></tendon>
<actuator>
  <motor name="m1" joint="j1" gear="3" ctrlrange="-2 2" ctrllimited="true"/>
  <position name="p2" joint="j2" kp="8" forcerange="-3 3" forcelimited="true"/>
  <general name="f3" joint="j3" dyntype="filter" dynprm=".05" gainprm="2"/>
  <motor name="free" joint="j3"/>
  <intvelocity name="iv" joint="j1" kp="2" actrange="-1 1"/>
  <damper name="d" joint="j2" ctrlrange="0 2" kv="1"/>
</actuator>
<sensor><jointpos name="q1" joint="j1"/><framepos name="tip" objtype="site" objname="tip"/>
  <accelerometer name="acc" site="tip"/><jointvel name="v2" joint="j2"/>
  <actuatorfrc name="frc" actuator="p2"/></sensor>
</mujoco>"""
ARM_SENSORS = ["q1", "tip", "acc", "v*", "frc", "jointpos:j3", "tendonpos:t"]
ARM_CHANNELS = {"y": {"m1": 1.5, "p2": -0.5}, "z": {"f3": 1.0, "iv": 0.3}, "w": {"d": 1.0}}
T = 3000  # steps


def driven(integrator):
    """The arm as a reservoir; a readout, gates, offset and inputs that move all of it."""
    reservoir = Reservoir(
        ARM, sensors=ARM_SENSORS, channels=ARM_CHANNELS, inputs=["free"], integrator=integrator
    )
    rng = np.random.default_rng(0)
    w_out = 0.02 * rng.normal(size=(reservoir.n_signals + 1, 3))
    offset = np.cumsum(rng.normal(size=(T, 3)), axis=0) / np.sqrt(T)
    inputs = np.sin(0.01 * np.arange(T))[:, None]
    return reservoir, w_out, np.array([1.0, 0.5, 0.7]), offset, inputs
