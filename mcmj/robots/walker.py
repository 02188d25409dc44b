"""What drives a robot's legs is a body: both in one MuJoCo model, a reservoir of its springs.

The body walks at another pace and size than it was taught at (robots.rescale). Its springs'
lengths are the signals; the outputs, of leg i,

    x_i    pushes the body's nodes, feedback channel i
    hip_i  is the set point of the hip's servo [rad]
    leg_i  is the set point of the leg's servo [m]; the load on it may enter the body (walk_scene)
"""

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body, require_plane
from mcmj.robots.leg_readouts import LegReadout
from mcmj.robots.quadruped import GRAVITY, Quadruped
from mcmj.robots.recorded_walk import record_walk
from mcmj.robots.rescale import SIZE, rescaled
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import INTEGRATOR, ROBOT, TRUNK, Terrain, walking_model
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.gaits import LEGS
from mcmj.utils.validation import Array, as_array, require_number


class Walker(Reservoir):
    """A robot driven by a body, or copies of both; the state carries over from walk to walk.

    Args:
        body: four feedback channels, one a leg, in the units it was taught in.
        robot: its sizes and servos.
        terrain: ground and load.
        pace: of the body, as many times faster than it was taught.
        coupling: g, how strongly the legs' loads enter the body; 0: not at all.
        timestep: of everything [s]; the default is 1 ms of the body as it was taught.
        integrator: one of MuJoCo's.
        copies: independent robots.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """

    def __init__(
        self,
        body: Body,
        robot: Quadruped,
        terrain: Terrain | None = None,
        *,
        pace: float = 8.0,
        coupling: float = 0.0,
        timestep: float | None = None,
        integrator: str = INTEGRATOR,
        copies: int | None = None,
    ) -> None:
        require_plane(body, "a walker")
        require_number("coupling", coupling, -np.inf)
        self.pace = pace
        small = rescaled(body, pace=pace, size=SIZE)
        bearing = coupling / (robot.mass * GRAVITY)
        channels = {f"x_{leg}": {f"fb{i}": 1.0} for i, leg in enumerate(LEGS)}
        channels |= {f"hip_{leg}": {f"{ROBOT}{leg}_hip": 1.0} for leg in LEGS}
        for i, leg in enumerate(LEGS):
            heard = -bearing * robot.leg_stiffness
            channels[f"leg_{leg}"] = {f"{ROBOT}{leg}_leg": 1.0, f"in{i}": heard}
        super().__init__(
            walking_model(small, robot, terrain or Terrain(), bearing),
            sensors="length*",
            channels=channels,
            timestep=1e-3 / pace if timestep is None else timestep,
            integrator=integrator,
            copies=copies,
        )
        self._nodes = 2 * len(body.free)  # joints of the body; the trunk's come next

    @property
    def motion(self) -> Array:
        """Positions and velocities of the body's joints now (.., 2, 2 n_free)."""
        both = [self.qpos[..., : self._nodes], self.qvel[..., : self._nodes]]
        return np.stack(both, axis=-2)

    def start(self, gait: LegReadout, motion: Array | None = None) -> None:
        """Put the robots on their feet, at rest and time 0, and the body into a gait's motion.

        Args:
            motion: of the body, one for all or (copies, 2, 2 n_free); default: the gait's start.
        """
        placed = gait.start if motion is None else motion
        self.reset()
        qpos, qvel = self.qpos, self.qvel
        qpos[..., : self._nodes], qvel[..., : self._nodes] = placed[..., 0, :], placed[..., 1, :]
        self.set_state(qpos, qvel)
        self.set_readout(gait.w_out)

    def walk(
        self,
        duration: float,
        *,
        push: npt.ArrayLike | None = None,
        sample: float = 4e-3,
        joints: bool = False,
    ) -> Walk:
        """Go on for a while.

        Args:
            duration: [s].
            push: (2,) or (copies, 2) horizontal impulses on the trunk [N s], a constant force
                over the first PUSH_DURATION.
            sample: time between samples [s], rounded to whole steps.
            joints: record all joints, for videos.

        Raises:
            DivergenceError: a copy blew up.
        """
        impulses = None
        if push is not None:
            lead = (self.copies or 1,) if np.ndim(push) == 2 else ()
            flat = as_array("push", push, (*lead, 2))
            impulses = {TRUNK: np.concatenate([flat, np.zeros((*lead, 1))], axis=-1)}
        first = self._nodes
        return record_walk(
            self, duration, sample, lambda qpos: qpos[..., first : first + 7],
            impulses=impulses, joints=joints,
        )  # fmt: skip
