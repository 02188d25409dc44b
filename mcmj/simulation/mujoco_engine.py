"""Copies of one body in MuJoCo, stepped wholly in C on several threads.

The only module that touches MuJoCo's state in a rollout. Arrays have the copies as their first
axis.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.body import Body
from mcmj.core.callbacks import install
from mcmj.core.callbacks.leapfrog import node_velocities
from mcmj.core.callbacks.spring_laws import spring_law
from mcmj.core.integrators import integrator_named
from mcmj.core.options import Options
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.damage import alter
from mcmj.utils.errors import DivergenceError
from mcmj.utils.forking import guard_against_forks
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array, as_array, require_count

_CTRL = mujoco.mjtState.mjSTATE_CTRL.value
_APPLIED = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
_TIME = mujoco.mjtState.mjSTATE_TIME.value
_NO_STAGE = mujoco.mjtStage.mjSTAGE_NONE.value
_POSITION_STAGE = mujoco.mjtStage.mjSTAGE_POS.value


class Engine:
    """MuJoCo's side of a simulation; see Simulation for the options."""

    def __init__(self, body: Body, options: Options, *, copies: int, threads: int) -> None:
        require_count("copies", copies, 1)
        require_count("threads", threads, 1)
        self.body, self.options = body, options
        timestep, integrator, substeps = options.timestep, options.integrator, options.substeps
        self.timestep, self.integrator, self.substeps = timestep, integrator, substeps
        self._physics_step = options.physics_step
        xml = to_mjcf(
            body,
            timestep=self._physics_step,
            integrator=integrator,
            w_out=np.zeros((body.n_springs + 1, body.n_outputs)),
            springs=options.springs,
            feedback_delay=options.feedback_delay * timestep,
            control_period=timestep if substeps > 1 else 0.0,
        )
        law = spring_law(options.springs)
        self._by_callback = integrator_named(integrator).by_callback
        self._passive = law is not None or self._by_callback
        install.install(passive=self._passive)  # first: MuJoCo's compiler calls them too
        self.model = load_model(xml)
        self.model.actuator_biasprm[body.n_inputs :, 0] = 0.0  # open until a drive closes it
        if substeps > 1:  # the first sample at t = 0: MJCF takes no phase beyond a period
            self.model.sensor_interval[: body.n_springs, 1] -= timestep
        if law is not None:
            self.model.tendon_user[: body.n_springs, 1] = law.key(body.n_springs)
        self._batch = Batch(self.model, copies, threads)
        if threads > 1:
            guard_against_forks(self)
        # joints are n<i>x, n<i>y (, n<i>z) in node order
        first = body.dimensions * np.arange(len(body.free))
        self._pushed = [(first + i, share) for i, share in enumerate(body.direction) if share]
        self.steps_done = 0
        self.reset()

    @property
    def copies(self) -> int:
        """Number of simulations."""
        return int(self._batch.nsim)

    def reset(self) -> None:
        """All copies back to the start, at rest, time 0."""
        self._batch.reset(stage=_NO_STAGE)
        self.steps_done = 0

    def set_readout(self, w_out: Array | None) -> None:
        """Readouts (rows, n_outputs) for all copies, or (copies, rows, n_outputs)."""
        if self.body.n_outputs == 0:
            return
        weights = self._batch.expand("actuator_user")[:, self.body.n_inputs :]
        weights[:] = 0.0
        if w_out is not None:
            weights[:, :, : w_out.shape[-2]] = np.swapaxes(w_out, -1, -2)

    def alter(self, cut: Sequence[int], masses: Array | None) -> None:
        """Cut springs and change masses (N,) of all copies, for good."""
        install.install(passive=self._passive)
        alter(self._batch, self.body, cut, masses)

    # --- state -------------------------------------------------------------------------------

    @property
    def state(self) -> State:
        """Positions and velocities (copies, N, D) now."""
        return State(
            positions=self._positions(self._batch.bind("qpos")),
            velocities=self._velocities(self._joint_velocities()),
            time=self.steps_done * self.timestep,
        )

    def set_state(self, positions: object, velocities: object) -> None:
        """Positions and velocities (N, D) for all copies, or (copies, N, D); None: as they are."""
        free, shape = self.body.free, self.body.positions.shape
        if self._by_callback:  # starts anew
            self._batch.bind("qvel")[:] = self._joint_velocities()
            self._batch.bind("userdata")[:] = 0.0
        for name, value, field, origin in (
            ("positions", positions, "qpos", self.body.positions),
            ("velocities", velocities, "qvel", 0.0),
        ):
            if value is not None:
                lead = (self.copies,) if np.asarray(value).ndim == 3 else ()
                array = as_array(name, value, (*lead, *shape)) - origin
                self._batch.bind(field)[:] = array[..., free, :].reshape(*lead, -1)

    def snapshot(self) -> Array:
        """Full integration state (copies, n): all that `restore` needs."""
        return np.column_stack([self._batch.state, np.full(self.copies, float(self.steps_done))])

    def restore(self, snapshot: Array) -> None:
        """Continue from a snapshot, bit for bit."""
        values = as_array("snapshot", snapshot, (self.copies, self._batch.nstate + 1))
        self._batch.state[:] = values[:, :-1]
        self.steps_done = int(values[0, -1])

    def current_lengths(self) -> Array:
        """Spring lengths (copies, L) [m] at the current state."""
        lengths = self._batch.bind("sensordata")
        with quiet_warnings():
            self._batch.forward(stage=_POSITION_STAGE)
        found: Array = lengths[:, -self.body.n_springs :].copy()
        return found

    def _positions(self, qpos: Array) -> Array:
        """Node positions (..., N, D) from joint positions (..., nq)."""
        shape = self.body.positions.shape
        positions = np.empty((*qpos.shape[:-1], *shape))
        positions[:] = self.body.positions
        positions[..., self.body.free, :] += qpos.reshape(*qpos.shape[:-1], -1, shape[1])
        return positions

    def _joint_velocities(self) -> Array:
        """Best estimates (copies, nv) of the velocities now [m/s]."""
        qvel, userdata = self._batch.bind("qvel"), self._batch.bind("userdata")
        return node_velocities(qvel, userdata, self._physics_step)

    def _velocities(self, qvel: Array) -> Array:
        """Node velocities (..., N, D) from joint velocities (..., nv)."""
        shape = self.body.positions.shape
        velocities = np.zeros((*qvel.shape[:-1], *shape))
        velocities[..., self.body.free, :] = qvel.reshape(*qvel.shape[:-1], -1, shape[1])
        return velocities

    # --- stepping ----------------------------------------------------------------------------

    def prepare(self, drive: Drive) -> None:
        """Set gates and clear old inputs before the first chunk of a drive."""
        if self.body.n_outputs:
            gates = self._batch.expand("actuator_biasprm")[:, self.body.n_inputs :, 0]
            gates[:] = drive.gate
        self._batch.ctrl = 0.0
        self._batch.qfrc_applied = 0.0

    def run(self, drive: Drive, record: tuple[str, ...], start: int, stop: int) -> dict[str, Array]:
        """Control steps start .. stop - 1 of a drive; returns the recorded arrays.

        Raises:
            DivergenceError: a copy blew up.
            McmjError: another package's callback is installed.
        """
        install.install(
            passive=self._passive
        )  # somebody may have taken them out since the last chunk
        batch, steps = self._batch, (stop - start) * self.substeps
        qpos, qvel = batch.bind("qpos").copy(), self._joint_velocities().copy()
        control, spec = self._control(drive, start, stop)
        items = {"positions": "qpos", "velocities": "qvel", "lengths": "sensordata"}
        wanted = [items[name] for name in record] or [_TIME]
        if "velocities" in record:
            wanted.append("userdata")
        time = batch.bind("time").copy()
        with quiet_warnings():
            rows = batch.rollout(steps, control, spec, wanted)
        self._check_alive(time, steps)
        self.steps_done += stop - start
        recorded = {}
        for name in record:
            samples = rows[items[name]]
            if name == "lengths":  # sensors show the start of the step, the state its end
                # the last L sensors are never delayed or held
                recorded[name] = samples[:, :: self.substeps, -self.body.n_springs :]
            elif name == "positions":
                recorded[name] = self._positions(_shifted(qpos, samples, self.substeps))
            else:
                after = node_velocities(samples, rows["userdata"], self._physics_step)
                recorded[name] = self._velocities(_shifted(qvel, after, self.substeps))
        return recorded

    def _control(self, drive: Drive, start: int, stop: int) -> tuple[Array | None, int]:
        """Rows (copies, steps, n) of ctrl, and of qfrc_applied if forces vary, and their spec."""
        body, forces = self.body, drive.forces
        lead: tuple[int, ...] = ()
        for array in (drive.inputs, drive.offset, forces):
            if array is not None and array.ndim == 3:
                lead = (self.copies,)
        varying = forces is not None and forces.shape[-2] > 1
        if forces is not None and not varying:
            for dofs, share in self._pushed:
                self._batch.bind("qfrc_applied")[:, dofs] = share * forces[..., 0, body.free]
        if drive.inputs is None and drive.offset is None and not varying:
            return None, _CTRL
        n_applied = self.model.nv if varying else 0
        control = np.zeros((*lead, stop - start, self.model.nu + n_applied))
        if drive.inputs is not None:
            control[..., : body.n_inputs] = drive.inputs[..., start:stop, :]
        if drive.offset is not None:
            control[..., body.n_inputs : self.model.nu] = drive.offset[..., start:stop, :]
        if varying and forces is not None:
            for dofs, share in self._pushed:
                control[..., self.model.nu + dofs] = share * forces[..., start:stop, body.free]
        spec = _CTRL | _APPLIED if varying else _CTRL
        return np.repeat(control, self.substeps, axis=-2), spec

    def _check_alive(self, time_before: Array, steps: int) -> None:
        """Raise if a copy stopped early or holds a number that is not finite."""
        time = self._batch.bind("time")
        step = self._physics_step
        done = np.rint((time - time_before) / step).astype(int)
        velocities = self._velocities(self._batch.bind("qvel"))
        dead = np.flatnonzero((done < steps) | ~np.isfinite(velocities).all(axis=(1, 2)))
        if not dead.size:
            return
        copy = dead[0]
        self.steps_done += int(done[copy]) // self.substeps
        with np.errstate(over="ignore"):
            speed = np.hypot.reduce(np.nan_to_num(velocities[copy], nan=np.inf), axis=1)
        node = int(speed.argmax())
        which = f"copy {copy}: " if self.copies > 1 else ""
        raise DivergenceError(
            f"{which}the simulation blew up after t = {time[copy]:.6g} s at node {node} (speed "
            f"{speed[node]:.3g} m/s), integrator {self.integrator}, step {1e3 * step:g} ms; try a "
            f"smaller step (substeps={2 * self.substeps}) or another integrator ('discrete' "
            "survives stiff dampers), or smaller forces and readout weights",
            time=float(time[copy]),
            steps_done=int(done[copy]) // self.substeps,
        )


def _shifted(first: Array, after: Array, substeps: int) -> Array:
    """Samples at the start of each control step, from `after` each physics step."""
    return np.concatenate([first[:, None], after], axis=1)[:, :-1:substeps]
