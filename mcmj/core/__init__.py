"""What an experiment is made of: the body, its springs' laws, a readout, an integrator, a trajectory.

Plain data, checked on construction. `callbacks/` holds what MuJoCo calls within a step.
"""
