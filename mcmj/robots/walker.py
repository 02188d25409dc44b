"""What drives a robot's legs is a body: both in one MuJoCo model, stepped wholly in C.

The body walks at another pace and size than it was taught at (robots.rescale). The law that joins
it to the robot (robots.walk_law) is all in actuators' user data; a teacher enters through ctrl.
"""

from dataclasses import replace

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.body import Body, require_plane
from mcmj.core.callbacks import install
from mcmj.core.callbacks.pointers import TAG
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.readout import Readout
from mcmj.core.trajectory import State
from mcmj.robots.leg_readouts import LegReadout
from mcmj.robots.quadruped import Quadruped
from mcmj.robots.rescale import rescaled, rescaled_readout
from mcmj.robots.walk_law import COMMANDS, actuators_of, leg_law
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import LEG_SENSORS, ROBOT, Terrain, walking_model
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import DivergenceError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count, require_number

SIZE = 1 / 32  # of the body: 100 m become 3 m; changes no bit
PUSH_DURATION = 0.1  # s
_VELOCITY_STAGE = mujoco.mjtStage.mjSTAGE_VEL.value
_CTRL = mujoco.mjtState.mjSTATE_CTRL.value


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
        require_plane(body, "a walker")
        require_number("coupling", coupling, -np.inf)
        require_count("copies", copies, 1)
        self.taught, self.robot, self.pace, self.coupling = body, robot, pace, coupling
        self.body = rescaled(replace(body, w_in=body.w_fb), pace=pace, size=SIZE)
        self.timestep = 1e-3 / pace if timestep is None else timestep
        install.install()  # first: MuJoCo's compiler calls it too
        self.model = walking_model(
            self.body, robot, terrain or Terrain(), timestep=self.timestep, integrator=integrator
        )
        self._add_law()
        self._batch = Batch(self.model, copies, 1)
        self._nodes = 2 * len(self.body.free)  # joints of the body; the trunk's come next
        self._cut = False
        self._readout = np.zeros((self.body.n_springs + 1, COMMANDS))
        for name in ("sensordata", "qfrc_actuator"):  # copied out by calls after this one only
            self._batch.bind(name)

    @property
    def copies(self) -> int:
        """Number of robots."""
        return int(self._batch.nsim)

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
        names = [self.model.actuator(index).name for index in range(self.model.nu)]
        self._law = leg_law(names, self.robot, gait.stride, self.coupling)
        self._readout = np.hstack([self._scaled(w).rows for w in (gait.swing, gait.lift)])
        self._hear(self._readout)

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
        found: Array = self._batch.state.copy()
        return found

    def restore(self, states: Array) -> None:
        """States from snapshots, (copies, n) or (n,) for all; the gait stays what it is."""
        self._batch.state[:] = states

    def stand(self) -> None:
        """Put the robots back on their feet where they started, at rest; the bodies go on."""
        start = self.model.qpos0[self._nodes :]
        self._batch.bind("qpos")[:, self._nodes :] = start
        self._batch.bind("qvel")[:, self._nodes :] = 0.0

    def body_state(self) -> State:
        """Positions and velocities of the first robot's body, in the units it was taught in."""
        positions, velocities = self.taught.positions.copy(), np.zeros((self.taught.n_nodes, 2))
        moved, speed = (
            self._batch.bind(name)[0, : self._nodes].reshape(-1, 2) for name in ("qpos", "qvel")
        )
        positions[self.taught.free] += moved / SIZE
        velocities[self.taught.free] = speed / (SIZE * self.pace)
        return State(positions, velocities, time=0.0)

    def advance(self, steps: int) -> None:
        """Go on for so many steps, recording nothing."""
        install.install()  # as before every run: somebody may have taken them out
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
        require_count("duration / sample", count, 1, MOST_STEPS)
        force = self._batch.bind("xfrc_applied")[:, self.model.body(ROBOT + "trunk").id]
        pushed = round(PUSH_DURATION / (stride * self.timestep))
        given = np.broadcast_to(np.asarray(0.0 if push is None else push), (self.copies, 2))
        impulse = as_array("push", given, (self.copies, 2))
        rows: dict[str, list[Array]] = {}
        install.install()
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

    def led(self, told: object, noise: object) -> Array:
        """Go on under a teacher, who gives the commands in the readouts' place.

        Args:
            told: (copies, steps, 8), x_i and z_i of each step.
            noise: (copies, steps, 4), on the x_i that are fed back, not on the legs'.

        Returns:
            The springs' lengths (copies, steps, L) at the start of each step, in the units the
            body was taught in [m].

        Raises:
            InvalidArgumentError: wrong shapes, or NaN.
            DivergenceError: a copy blew up.
        """
        commands = as_array("told", told, (self.copies, None, COMMANDS))
        steps, n = commands.shape[1], self.body.n_springs
        control = commands @ self._law.commands.T
        control[..., self._feedback] += as_array("noise", noise, (self.copies, steps, len(LEGS)))
        self._hear(np.zeros_like(self._readout))
        install.install()
        with quiet_warnings():
            sensors = self._batch.rollout(steps, control, _CTRL, ["sensordata"])["sensordata"]
        self._batch.ctrl = 0.0
        self._hear(self._readout)
        self._check_alive()
        found: Array = sensors[..., :n] / SIZE
        return found

    # --- inside ------------------------------------------------------------------------------

    def _add_law(self) -> None:
        """Make feedback, inputs and drives of the legs user actuators over all sensors needed."""
        model = self.model
        first, count = model.sensor("length0").adr[0], self.body.n_springs + LEG_SENSORS
        for channel, leg in enumerate(LEGS):
            for name in actuators_of(leg, channel=channel):
                actuator = model.actuator(name)
                actuator.biastype[:] = mujoco.mjtBias.mjBIAS_USER
                actuator.biasprm[:5] = [1.0, TAG, first, count, 0.0]
        self._feedback = [model.actuator(f"fb{channel}").id for channel in range(len(LEGS))]

    def _hear(self, readout: Array) -> None:
        """Command the legs by a readout (L + 1, 8) of the springs."""
        self._batch.expand("actuator_user")[:] = self._law.weights(readout)

    def _scaled(self, w_out: Array) -> Readout:
        """A readout of the smaller body."""
        rows = rescaled_readout(self.taught, w_out, size=SIZE)
        return Readout.from_rows(rows, self.body.n_springs)

    def _sample(self, joints: bool) -> dict[str, Array]:
        batch, n, trunk = self._batch, self.body.n_springs, self._nodes
        qpos, sensors = batch.bind("qpos"), batch.bind("sensordata")
        swing = Readout.from_rows(self._readout[:, : len(LEGS)], n)
        power = batch.bind("qfrc_actuator") * batch.bind("qvel")
        now = {
            "trunk": qpos[:, trunk : trunk + 7].copy(),
            "outputs": swing.weighted(sensors[:, :n]) + swing.bias,
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
