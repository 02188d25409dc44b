"""A robot and the body that drives it, in one MuJoCo model; stepped wholly in C.

The planar body is the model that mcmj.mjcf writes, at another pace and size (mcmj.units), and
the robot (mcmj.quadruped) is attached to it by MjSpec. Gravity cannot move the body's nodes,
which slide horizontally. Two kinds of weights join the two models, all in actuators' user data:

    forth  x_i and z_i, readouts of the springs, are the set points of the legs' servos
    back   u_i = g F_i / (M gravity) is the body's input i     F_i = k (b_i - B_i z_i) + d b_i'

F_i is the force that the servo of leg i bears, linear in springs and in the joint's sensors like
everything here. Input i pushes the nodes that feedback channel i pushes, as strongly. With
g = 0 the body does not know of the robot.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj import laws
from mcmj.body import Body
from mcmj.errors import DivergenceError, InvalidArgumentError
from mcmj.gaits import LEGS
from mcmj.legs import LegReadout
from mcmj.memory import TAG
from mcmj.mjcf import DEFAULT_INTEGRATOR, to_mjcf
from mcmj.quadruped import GRAVITY, Quadruped, quadruped_mjcf
from mcmj.quiet import quiet_warnings
from mcmj.units import rescaled, rescaled_readout
from mcmj.validation import Array, as_array, require_count, require_number
from mcmj.walkmetrics import Walk

ROBOT = "robot/"
GROUND_GROUP = 2  # of geoms, for renderers that leave the ground out
SIZE = 1 / 32  # of the body: 100 m become 3 m; changes no bit
PUSH_DURATION = 0.1  # s
_LEG_SENSORS = 2 * len(LEGS)  # length and rate of each leg
_VELOCITY_STAGE = mujoco.mjtStage.mjSTAGE_VEL.value


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
    spec.nuser_actuator = body.n_springs + _LEG_SENSORS + 1
    return spec.compile()


def _paint_squares(spec: mujoco.MjSpec, side: float) -> None:
    """A ground on which motion shows: squares as long as a leg [m]."""
    spec.add_texture(
        name="squares", type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.97, 0.97, 0.95], rgb2=[0.9, 0.91, 0.89], width=64, height=64,
    )  # fmt: skip
    textures = [""] * mujoco.mjtTextureRole.mjNTEXROLE
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
    spec.add_material(
        name="squares", textures=textures, texrepeat=[1 / side, 1 / side], texuniform=True
    )


class Walker:
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
        integrator: str = DEFAULT_INTEGRATOR,
        copies: int = 1,
    ) -> None:
        require_number("coupling", coupling, -np.inf)
        require_count("copies", copies, 1)
        self.taught, self.robot, self.pace, self.coupling = body, robot, pace, coupling
        self.body = rescaled(replace(body, w_in=body.w_fb), pace=pace, size=SIZE)
        self.timestep = 1e-3 / pace if timestep is None else timestep
        laws.install()  # first: MuJoCo's compiler calls it too
        self.model = walking_model(
            self.body, robot, terrain or Terrain(), timestep=self.timestep, integrator=integrator
        )
        self._add_law()
        self._batch = Batch(self.model, copies, 1)
        self._nodes = 2 * len(self.body.free)  # joints of the body; the trunk's come next
        self._cut = False
        self._readout = np.zeros((len(LEGS), self.body.n_springs + 1))
        for name in ("sensordata", "qfrc_actuator"):  # copied out by calls after this one only
            self._batch.bind(name)

    @property
    def copies(self) -> int:
        """Number of robots."""
        return self._batch.nsim

    @property
    def mass(self) -> float:
        """Of a robot with its load [kg]."""
        return float(self.model.body(ROBOT + "trunk").subtreemass[0])

    def start(self, gait: LegReadout) -> None:
        """Put the body into a gait's motion and the robot on its feet, at time 0."""
        self._batch.reset()
        moved = gait.start.positions - self.taught.positions
        free = self.taught.free
        self._batch.bind("qpos")[:, : self._nodes] = (SIZE * moved[free]).ravel()
        speed = SIZE * self.pace
        self._batch.bind("qvel")[:, : self._nodes] = (speed * gait.start.velocities[free]).ravel()
        self.set_gait(gait)

    def set_gait(self, gait: LegReadout) -> None:
        """Switch the readouts, at once."""
        if self._cut:  # broken springs measure nothing
            gait = replace(gait, swing=0 * gait.swing, lift=0 * gait.lift)
        self._gait = gait
        self._batch.expand("actuator_user")[:] = self._weights(gait)

    def cut_springs(self) -> None:
        """Cut all springs of the body: they pull no more, and no readout hears from them."""
        for name in ("stiffness", "stiffnesspoly", "damping", "dampingpoly"):
            self._batch.expand(f"tendon_{name}")[:] = 0.0
        self._cut = True
        self.set_gait(self._gait)

    def freeze(self) -> None:
        """Hold all nodes of the body where they are, by dampers that let nothing through."""
        self._batch.expand("dof_damping")[:, : self._nodes] = 1e15

    def snapshot(self) -> Array:
        """States of all copies (copies, n)."""
        return self._batch.state.copy()

    def restore(self, states: Array) -> None:
        """States from snapshots, (copies, n) or (n,) for all; the gait stays what it is."""
        self._batch.state[:] = states

    def advance(self, steps: int) -> None:
        """Go on for so many steps, recording nothing."""
        with quiet_warnings():
            self._batch.step(nstep=steps)

    def walk(
        self, duration: float, *, push: object = None, sample: float = 4e-3, joints: bool = False
    ) -> Walk:
        """Go on for a while.

        Args:
            duration: [s].
            push: (copies, 2) or (2,) horizontal impulses on the trunk [N s], a constant force
                over the first PUSH_DURATION.
            sample: time between samples [s], rounded to whole steps.
            joints: record all joints, for videos.

        Raises:
            DivergenceError: a copy blew up.
        """
        require_number("sample", sample, 0.0, open_low=True)
        stride = max(1, round(sample / self.timestep))
        count = round(duration / (stride * self.timestep))
        require_count("duration / sample", count, 1)
        force = self._batch.bind("xfrc_applied")[:, self.model.body(ROBOT + "trunk").id]
        pushed = round(PUSH_DURATION / (stride * self.timestep))
        given = np.broadcast_to(np.asarray(0.0 if push is None else push), (self.copies, 2))
        impulse = as_array("push", given, (self.copies, 2))
        rows: dict[str, list[Array]] = {}
        with quiet_warnings():
            for k in range(count):
                force[:, :2] = impulse / PUSH_DURATION if k < pushed else 0.0
                self._batch.step(nstep=stride, stage=_VELOCITY_STAGE)
                for name, values in self._sample(joints).items():
                    rows.setdefault(name, []).append(values)
        self._check_alive()
        recorded = {name: np.stack(values, axis=1) for name, values in rows.items()}
        times = stride * self.timestep * np.arange(1, count + 1, dtype=np.float64)
        return Walk(times, **recorded)

    # --- inside ------------------------------------------------------------------------------

    def _add_law(self) -> None:
        """Make inputs and drives of the legs user actuators over springs and leg sensors."""
        model, robot = self.model, self.robot
        first = model.sensor("length0").adr[0]
        gates = {f"in{c}": 1.0 for c in range(len(LEGS))} | {
            f"fb{c}": 1.0 for c in range(len(LEGS))
        }
        for leg in LEGS:
            gates[f"{ROBOT}{leg}_swing"] = robot.hip_stiffness
            gates[f"{ROBOT}{leg}_lift"] = robot.leg_stiffness
        for name, gate in gates.items():
            actuator = model.actuator(name)
            actuator.biastype[:] = mujoco.mjtBias.mjBIAS_USER
            actuator.biasprm[:5] = [gate, TAG, first, self.body.n_springs + _LEG_SENSORS, 0.0]

    def _weights(self, gait: LegReadout) -> Array:
        """User data (actuators, L springs + 8 leg sensors + bias) of a gait."""
        n, robot = self.body.n_springs, self.robot
        weights = np.zeros((self.model.nu, n + _LEG_SENSORS + 1))
        position, lift = (self._with_bias(w) for w in (gait.swing, gait.lift))
        angle = position * gait.stride.of_legs("swing")
        angle[-1] += gait.stride.of_legs("lean")
        drawn_in = lift * gait.stride.of_legs("lift")
        bearing = self.coupling / (robot.mass * GRAVITY)  # of a robot without load
        springs = np.r_[:n, n + _LEG_SENSORS]
        for i, leg in enumerate(LEGS):
            for name, column in (
                (f"fb{i}", position[:, i]),
                (f"{ROBOT}{leg}_swing", angle[:, i]),
                (f"{ROBOT}{leg}_lift", drawn_in[:, i]),
                (f"in{i}", -bearing * robot.leg_stiffness * drawn_in[:, i]),
            ):
                weights[self.model.actuator(name).id, springs] = column
            length, rate = n + 2 * i, n + 2 * i + 1
            weights[self.model.actuator(f"in{i}").id, [length, rate]] = (
                bearing * robot.leg_stiffness,
                bearing * robot.leg_damping,
            )
        self._readout = position.T
        return weights

    def _with_bias(self, w_out: Array) -> Array:
        """A readout of the faster, smaller body, (L + 1, 4)."""
        scaled = rescaled_readout(self.taught, w_out, size=SIZE)
        missing = self.body.n_springs + 1 - len(scaled)
        return np.vstack([scaled, np.zeros((missing, len(LEGS)))])

    def _sample(self, joints: bool) -> dict[str, Array]:
        batch, n, trunk = self._batch, self.body.n_springs, self._nodes
        qpos, sensors = batch.bind("qpos"), batch.bind("sensordata")
        lengths = sensors[:, :n]
        power = batch.bind("qfrc_actuator") * batch.bind("qvel")
        now = {
            "trunk": qpos[:, trunk : trunk + 7].copy(),
            "outputs": np.einsum("cl,nl->nc", self._readout[:, :n], lengths) + self._readout[:, n],
            "contact": sensors[:, -len(LEGS) :].copy(),
            "power": np.maximum(power[:, trunk + 6 :], 0.0).sum(axis=1),
        }
        return now | {"joints": qpos.copy()} if joints else now

    def _check_alive(self) -> None:
        dead = np.flatnonzero(~np.isfinite(self._batch.bind("qvel")).all(axis=1))
        if dead.size:
            time = float(self._batch.bind("time")[dead[0]])
            raise DivergenceError(
                f"copy {dead[0]}: the walk blew up before t = {time:.6g} s, step "
                f"{1e3 * self.timestep:g} ms; try a smaller step, or softer legs",
                time=time, steps_done=round(time / self.timestep),
            )  # fmt: skip
