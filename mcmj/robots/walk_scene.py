"""The scene of a walk as one MuJoCo model: a planar body, a robot beside it, the ground.

The body is the model that mjcf writes, and the robot (robots.quadruped) is attached to it by
MjSpec. Gravity cannot move the body's nodes, which slide horizontally.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.mjcf.write import to_mjcf
from mcmj.robots.quadruped import GRAVITY, Quadruped, quadruped_mjcf
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_number

ROBOT = "robot/"  # what the names of its parts begin with
GROUND_GROUP = 2  # of geoms, for renderers that leave the ground out
LEG_SENSORS = 2 * len(LEGS)  # length and rate of each leg, right after the springs' lengths


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


def walking_model(
    body: Body, robot: Quadruped, terrain: Terrain, *, timestep: float, integrator: str
) -> mujoco.MjModel:
    """One model of a body (w_in of four channels) and a robot beside it.

    Raises:
        InvalidArgumentError: a body without a channel a leg.
    """
    if (body.n_inputs, body.n_outputs) != (len(LEGS), len(LEGS)):
        raise InvalidArgumentError("body", f"{len(LEGS)} inputs and outputs, one a leg", body)
    no_readout = np.zeros((body.n_springs + 1, len(LEGS)))
    text = to_mjcf(body, timestep=timestep, integrator=integrator, w_out=no_readout)
    spec = mujoco.MjSpec.from_string(text)
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    # contacts of the feet need constraints; a state that blew up is kept for the error message
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    half = terrain.slope / 2
    tilt = [np.cos(half), 0.0, -np.sin(half), 0.0]
    _paint_squares(spec, robot.leg)
    spec.worldbody.add_geom(
        name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], quat=tilt,
        contype=0, conaffinity=1, material="squares", group=GROUND_GROUP,
    )  # fmt: skip
    beside = body.positions[:, 1].min() - 2 * robot.leg
    above = robot.standing_height * np.array([-np.sin(terrain.slope), 0.0, np.cos(terrain.slope)])
    frame = spec.worldbody.add_frame(pos=above + np.array([0.0, beside, 0.0]), quat=tilt)
    loaded = replace(robot, trunk=robot.trunk + terrain.load)
    spec.attach(mujoco.MjSpec.from_string(quadruped_mjcf(loaded)), prefix=ROBOT, frame=frame)
    spec.nuser_actuator = body.n_springs + LEG_SENSORS + 1
    return spec.compile()


def _paint_squares(spec: mujoco.MjSpec, side: float) -> None:
    """A ground on which motion shows: squares as long as a leg [m]."""
    spec.add_texture(
        name="squares", type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.78, 0.78, 0.76], rgb2=[0.71, 0.72, 0.70], width=64, height=64,
    )  # fmt: skip
    textures = [""] * mujoco.mjtTextureRole.mjNTEXROLE
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
    spec.add_material(
        name="squares", textures=textures, texrepeat=[1 / side, 1 / side], texuniform=True
    )
