"""What an experiment is made of: body, spring laws, readout, integrator, trajectory.

Plain data, checked on construction. `callbacks/` holds what MuJoCo calls within a step.
"""
