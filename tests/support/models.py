"""MuJoCo models that are no bodies of mcmj."""

# a soft two-link chain that swings in a plane; two motors
CHAIN = """
<mujoco><option timestep="0.002" gravity="0 0 0" integrator="implicitfast"/><worldbody>
<body name="a"><joint name="j1" axis="0 0 1" damping=".05" stiffness="2"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/>
<body name="b" pos=".2 0 0"><joint name="j2" axis="0 0 1" damping=".02" stiffness="1"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/></body></body></worldbody>
<actuator><motor name="m1" joint="j1"/><motor name="m2" joint="j2"/></actuator></mujoco>"""
CHAIN_PARTS = {"sensors": ["jointpos:*", "jointvel:*"], "channels": ["m1", "m2"]}
