"""Copies of one model in MuJoCo's Batch, stepped wholly in C on several threads.

What bodies (mcmj.simulation.body_engine) and other models (mcmj.simulation.models.engine) have in
common: the state, the drive, and the check that the numbers are finite. Arrays have the copies as
their first axis.
"""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from mcmj.core.callbacks import install
from mcmj.core.rollout_arguments import Drive
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.forking import guard_against_forks
from mcmj.utils.quiet import quiet_warnings, untimed
from mcmj.utils.validation import Array, require_count

_CTRL = mujoco.mjtState.mjSTATE_CTRL.value
_APPLIED = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
_TIME = mujoco.mjtState.mjSTATE_TIME.value
_NO_STAGE = mujoco.mjtStage.mjSTAGE_NONE.value
MOST_CONTROL = mujoco.mjMAXVAL
POSITION_STAGE = mujoco.mjtStage.mjSTAGE_POS.value


class Channels(NamedTuple):
    """Where a drive enters a model, and what its readout hears.

    Attributes:
        inputs, outputs: the actuators of inputs and of feedback channels.
        forces: which columns of the forces act.
        pushed: the degrees of freedom that each of them acts on, and its share there.
        signals: (n_signals,) where they stand in sensordata.
        late: (n_signals,) bool: MuJoCo computes it after actuation.
        kept: (n,) in sensordata, what is part of a snapshot, see mcmj.simulation.models.adopt.
    """

    inputs: slice
    outputs: slice
    forces: npt.NDArray[np.int64]
    pushed: Sequence[tuple[npt.NDArray[np.int64], float]]
    signals: npt.NDArray[np.int64]
    late: npt.NDArray[np.bool_]
    kept: npt.NDArray[np.int64]


class BatchEngine:
    """Copies of a compiled model that a drive enters through channels.

    Args:
        timestep: control step [s]; `substeps` of the model's steps.
        copies, threads: of the batch.
    """

    advice = "try a smaller step, another integrator, or smaller outputs"
    _lenient = False  # copies that blow up are no errors
    _passive = False  # whether mcmj's callback makes passive forces
    _sensors = False  # whether mcmj's callback measures lengths
    _stage = POSITION_STAGE  # up to which sensors are of use

    def __init__(
        self,
        model: mujoco.MjModel,
        channels: Channels,
        *,
        timestep: float,
        substeps: int = 1,
        copies: int = 1,
        threads: int = 1,
    ) -> None:
        require_count("copies", copies, 1)
        require_count("threads", threads, 1)
        self.model, self.timestep, self.substeps = model, timestep, substeps
        self.channels = channels
        try:
            self.batch = Batch(model, copies, threads)
        except ValueError as error:  # what batches do not take, such as sleeping bodies
            raise InvalidArgumentError("model", "one that MuJoCo's Batch takes", error) from error
        if threads > 1:
            guard_against_forks(self)
        self._views: dict[str, Array] = {}
        self.alive = np.ones(copies, np.bool_)  # not blown up since the start, or `restore`
        self.steps_done = 0
        self.reset()

    @property
    def copies(self) -> int:
        """Number of simulations."""
        return int(self.batch.nsim)

    def bound(self, name: str) -> Array:
        """A view (copies, n) of the simulations' data, made once: making one is slow."""
        if name not in self._views:
            self._views[name] = self.batch.bind(name)
        return self._views[name]

    def leave_behind(self) -> None:
        """From now on, copies that blow up are no errors; `alive` says which."""
        self._lenient = True

    def start_anew(self, data: mujoco.MjData) -> None:
        """Before the velocities of a state are changed: let the integrator forget older ones."""

    def reset(self) -> None:
        """All copies back to the start, time 0."""
        self.batch.reset(stage=_NO_STAGE)
        self.alive[:] = True
        self.steps_done = 0

    def set_readout(self, w_out: Array | None) -> None:
        """Readouts (rows, n_outputs) for all copies, or (copies, rows, n_outputs)."""
        if self.channels.outputs.stop == self.channels.outputs.start:
            return
        weights = self.batch.expand("actuator_user")[:, self.channels.outputs]
        weights[:] = 0.0
        if w_out is not None:
            weights[:, :, : w_out.shape[-2]] = np.swapaxes(w_out, -1, -2)

    def snapshot(self) -> Array:
        """Full integration state (copies, n): all that `restore` needs."""
        return np.column_stack([self.batch.state, np.full(self.copies, float(self.steps_done))])

    def restore(self, snapshot: Array) -> None:
        """Continue from a snapshot, bit for bit.

        Raises:
            InvalidArgumentError: another shape.
        """
        shape = (self.copies, self.batch.nstate + 1)
        if snapshot.shape != shape:
            raise InvalidArgumentError("snapshot", f"shape {shape}", f"shape {snapshot.shape}")
        self.batch.state[:] = snapshot[:, :-1]
        self.alive[:] = True
        self.steps_done = int(snapshot[0, -1])

    def sensors_now(self) -> Array:
        """All sensors (copies, n) of the state as it is."""
        sensors = self.bound("sensordata")
        self.install()
        with quiet_warnings():
            self.batch.forward(stage=self._stage)
        return sensors

    # --- stepping ----------------------------------------------------------------------------

    def prepare(self, drive: Drive) -> None:
        """Set gates and clear old inputs before the first chunk of a drive."""
        gates = self.batch.expand("actuator_biasprm")[:, self.channels.outputs, 0]
        gates[:] = drive.gate
        self.batch.ctrl = 0.0
        self.batch.qfrc_applied = 0.0

    def install(self) -> None:
        """Callbacks again: somebody may have taken them out since the last chunk."""
        install.install(passive=self._passive, sensors=self._sensors)

    def _advance(self, drive: Drive, start: int, stop: int, fields: list[str]) -> dict[str, Array]:
        """Fields (copies, steps, n) after each physics step of control steps start .. stop - 1."""
        self.install()
        steps = (stop - start) * self.substeps
        control, spec = self._control(drive, start, stop)
        before = self.bound("time").copy()
        with untimed():
            rows: dict[str, Array] = self.batch.rollout(steps, control, spec, fields or [_TIME])
        self._check_alive(before, steps)
        self.steps_done += stop - start
        return rows

    def _control(self, drive: Drive, start: int, stop: int) -> tuple[Array | None, int]:
        """Rows (copies, steps, n) of ctrl, and of qfrc_applied if forces vary, and their spec."""
        forces, at = drive.forces, self.channels
        lead: tuple[int, ...] = ()
        for array in (drive.inputs, drive.offset, forces):
            if array is not None and array.ndim == 3:
                lead = (self.copies,)
        varying = forces is not None and forces.shape[-2] > 1
        if forces is not None and not varying:
            for dofs, share in at.pushed:
                self.bound("qfrc_applied")[:, dofs] = share * forces[..., 0, at.forces]
        if drive.inputs is None and drive.offset is None and not varying:
            return None, _CTRL
        nu, n_applied = self.model.nu, self.model.nv if varying else 0
        control = np.zeros((*lead, stop - start, nu + n_applied))
        for rows, place in ((drive.inputs, at.inputs), (drive.offset, at.outputs)):
            if rows is not None:
                control[..., place] = rows[..., start:stop, :]
        if varying and forces is not None:
            for dofs, share in at.pushed:
                control[..., nu + dofs] = share * forces[..., start:stop, at.forces]
        spec = _CTRL | _APPLIED if varying else _CTRL
        return np.repeat(control, self.substeps, axis=-2), spec

    def _check_alive(self, time_before: Array, steps: int) -> None:
        """Raise, or note, that a copy stopped early or holds a number that is not finite."""
        time, step = self.bound("time"), self.timestep / self.substeps
        done = np.rint((time - time_before) / step).astype(int)
        finite = np.isfinite(self.bound("qvel")).all(axis=1)
        dead = np.flatnonzero((done < steps) | ~finite)
        self.alive[dead] = False
        if not dead.size or self._lenient:
            return
        copy = dead[0]
        self.steps_done += int(done[copy]) // self.substeps
        which = f"copy {copy}: " if self.copies > 1 else ""
        raise DivergenceError(
            f"{which}the simulation blew up after t = {time[copy]:.6g} s at {self._fastest(copy)}, "
            f"step {1e3 * step:g} ms; {self.advice}",
            time=float(time[copy]),
            steps_done=int(done[copy]) // self.substeps,
        )

    def _fastest(self, copy: int) -> str:
        """What moves fastest in a copy, and how fast; or a control that MuJoCo does not take."""
        controls = np.abs(self.bound("ctrl")[copy])
        if controls.max(initial=0.0) > MOST_CONTROL:
            actuator = self.model.actuator(int(controls.argmax())).name
            return f"actuator {actuator!r} (control {controls.max():.3g})"
        speeds = np.nan_to_num(np.abs(self.bound("qvel")[copy]), nan=np.inf)
        dof = int(speeds.argmax())
        joint = self.model.joint(int(self.model.dof_jntid[dof])).name
        return f"joint {joint!r} (speed {speeds[dof]:.3g})"


def shifted(first: Array, after: Array, substeps: int = 1) -> Array:
    """Samples at the start of each control step, from `after` each physics step."""
    return np.concatenate([first[:, None], after], axis=1)[:, :-1:substeps]
