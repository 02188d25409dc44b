"""The scene of a walk as one MuJoCo model: a planar body, a robot beside it, the ground.

The body is the model that mjcf writes, its feedback channels without a law of their own, and the
robot (robots.quadruped) is attached to it by MjSpec. Gravity cannot move the body's nodes, which
slide horizontally. What the ground does to leg i may enter the body, through the input

    u_i = g F_i / (M gravity)      F_i = k (b_i - B_i) + d b_i'

F_i is the force that the servo of leg i bears at length b_i and set point B_i, and M is the
robot's mass without load. Input i pushes the nodes that feedback channel i pushes, as strongly.
All but B_i, which comes from outside, is an actuator with the legs' sensors as its weights, run
by the compiled callback of callbacks.install.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.pointers import TAG
from mcmj.mjcf.write import to_mjcf
from mcmj.robots.ground import SQUARES, paint_squares
from mcmj.robots.quadruped import GRAVITY, Quadruped, quadruped_mjcf
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_number

ROBOT = "robot/"  # what the names of its parts begin with
TRUNK = ROBOT + "trunk"
INTEGRATOR = "Euler"  # of a robot: what it touches needs MuJoCo's own
GROUND_GROUP = 2  # of geoms, for renderers that leave the ground out


@dataclass(frozen=True)
class Terrain:
    """Where the robot walks, and what it carries.

    Attributes:
        slope: of the ground, uphill positive [rad].
        load: fixed to the trunk's middle [kg].
    """

    slope: float = 0.0
    load: float = 0.0

    def __post_init__(self) -> None:
        require_number("slope", self.slope, -1.0, 1.0)
        require_number("load", self.load, 0.0)


def walking_model(body: Body, robot: Quadruped, terrain: Terrain, bearing: float) -> mujoco.MjSpec:
    """One model of a body and a robot beside it.

    Args:
        bearing: g / (M gravity) [1/N].

    Raises:
        InvalidArgumentError: a body without a feedback channel a leg.
    """
    if body.n_outputs != len(LEGS):
        raise InvalidArgumentError("body", f"{len(LEGS)} feedback channels, one a leg", body)
    spec = mujoco.MjSpec.from_string(to_mjcf(replace(body, w_in=body.w_fb), integrator=INTEGRATOR))
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    # contacts of the feet need constraints; a state that blew up is kept for the error message
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    half = terrain.slope / 2
    tilt = [np.cos(half), 0.0, -np.sin(half), 0.0]
    paint_squares(spec, robot.leg, (0.78, 0.71))
    spec.worldbody.add_geom(
        name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], quat=tilt,
        contype=0, conaffinity=1, material=SQUARES, group=GROUND_GROUP,
    )  # fmt: skip
    beside = body.positions[:, 1].min() - 2 * robot.leg
    above = robot.standing_height * np.array([-np.sin(terrain.slope), 0.0, np.cos(terrain.slope)])
    frame = spec.worldbody.add_frame(pos=above + np.array([0.0, beside, 0.0]), quat=tilt)
    loaded = replace(robot, trunk=robot.trunk + terrain.load)
    spec.attach(mujoco.MjSpec.from_string(quadruped_mjcf(loaded)), prefix=ROBOT, frame=frame)
    _couple(spec, robot, body.n_springs, bearing)
    return spec


def _couple(spec: mujoco.MjSpec, robot: Quadruped, n_springs: int, bearing: float) -> None:
    """What the legs' sensors, which follow the springs' lengths, bring into the body."""
    heard = bearing * np.array([robot.leg_stiffness, robot.leg_damping])
    for i in range(len(LEGS)):
        spec.actuator(f"fb{i}").biastype = mujoco.mjtBias.mjBIAS_NONE
        actuator = spec.actuator(f"in{i}")
        actuator.biastype = mujoco.mjtBias.mjBIAS_USER
        actuator.biasprm[:5] = [1.0, TAG, n_springs, 2 * len(LEGS), 0.0]
        actuator.userdata = np.kron(np.eye(len(LEGS))[i], heard)
