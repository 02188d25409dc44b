"""The compiled model of a body that a Simulation steps: with MuJoCo's tendons, or without."""

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.spring_laws import spring_law
from mcmj.core.integrators import integrator_named
from mcmj.core.options import TENDONS, Options
from mcmj.mjcf.read import load_model
from mcmj.mjcf.without_tendons import model_without_tendons
from mcmj.mjcf.write import to_mjcf


def has_tendons(options: Options) -> bool:
    """Where asked for, and where an integrator needs the derivatives of the springs' forces."""
    return options.engine == TENDONS or integrator_named(options.integrator).implicit


def body_model(body: Body, options: Options) -> mujoco.MjModel:
    """Compile it, the loop open, with room for a readout with bias.

    Raises:
        BodyFileError: MuJoCo cannot compile it.
    """
    if not has_tendons(options):
        return model_without_tendons(body, options)
    xml = to_mjcf(
        body,
        timestep=options.physics_step,
        integrator=options.integrator,
        w_out=np.zeros((body.n_springs + 1, body.n_outputs)),
        springs=options.springs,
        feedback_delay=options.feedback_delay * options.timestep,
        control_period=options.timestep if options.substeps > 1 else 0.0,
    )
    model = load_model(xml)
    model.actuator_biasprm[body.n_inputs :, 0] = 0.0  # open until a drive closes it
    if options.substeps > 1:  # the first sample at t = 0: MJCF takes no phase beyond a period
        model.sensor_interval[: body.n_springs, 1] -= options.timestep
    law = spring_law(options.springs)
    if law is not None:
        model.tendon_user[: body.n_springs, 1] = law.key(body.n_springs)
    return model
