"""Copies of any model with its channels, as an engine of a reservoir."""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from mcmj.core.callbacks import install
from mcmj.core.rollout_arguments import Drive
from mcmj.simulation.batch_engine import BatchEngine, Channels, shifted
from mcmj.simulation.models.adopt import AdoptedModel
from mcmj.simulation.models.damage import alter_batch
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.validation import Array, as_array, require_count

_VELOCITY_STAGE = mujoco.mjtStage.mjSTAGE_VEL.value


class ModelEngine(BatchEngine):
    """MuJoCo's side of a reservoir; see Reservoir for the arguments.

    Sensors that MuJoCo computes after actuation are heard late, as they were one step before; the
    engine keeps them from chunk to chunk, for the law, snapshots and records.
    """

    recordable: tuple[str, ...] = ("signals", "qpos", "qvel", "sensordata")
    _stage = _VELOCITY_STAGE

    def __init__(self, adopted: AdoptedModel, *, copies: int, threads: int) -> None:
        install.install_control()
        self.adopted = adopted
        # a state that blew up is kept for the error message; with the flag, MuJoCo's sensor of the
        # kinetic energy is a step late
        adopted.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
        adopted.model.opt.enableflags &= ~mujoco.mjtEnableBit.mjENBL_ENERGY.value
        first, n_outputs = adopted.first, len(adopted.channel_names)
        dofs = np.arange(adopted.model.nv)
        require_count("copies", copies, 1)
        self._kept = np.zeros((copies, len(adopted.kept)))
        channels = Channels(
            inputs=slice(first + n_outputs, first + n_outputs + len(adopted.input_names)),
            outputs=slice(first, first + n_outputs),
            forces=dofs,
            pushed=[(dofs, 1.0)],
            signals=adopted.signals,
            late=adopted.late,
            kept=adopted.kept,
        )
        timestep = float(adopted.model.opt.timestep)
        super().__init__(adopted.model, channels, timestep=timestep, copies=copies, threads=threads)

    def install(self) -> None:
        """Callbacks again, that of the reservoir's law too."""
        super().install()
        install.install_control()

    def pushes(self, forces: Mapping[str, object]) -> Array:
        """Forces (3,) [N], or forces and torques (6,), on bodies by name, as (copies, n_bodies, 6).

        Each is the same for all copies, or (copies, 3) or (copies, 6).

        Raises:
            InvalidArgumentError, UnknownNameError: wrong shape, or no such body.
        """
        names = [self.model.body(i).name if i else "" for i in range(self.model.nbody)]
        found = np.zeros((self.copies, self.model.nbody, 6))
        for name, force in forces.items():
            if name not in names:
                raise UnknownNameError("body", name, [known for known in names if known])
            shape = np.asarray(force).shape
            lead = (self.copies,) if len(shape) == 2 else ()
            size = 6 if shape[-1:] == (6,) else 3
            given = as_array(f"forces on {name}", force, (*lead, size))
            found[:, names.index(name), :size] = given
        return found

    def alter(self, cut: Sequence[str], masses: Mapping[str, float] | None) -> None:
        """Cut tendons, and masses [kg] of bodies; see mcmj.simulation.models.damage."""
        alter_batch(self.batch, self.model, cut, masses or {})

    # --- state -------------------------------------------------------------------------------

    def reset(self) -> None:
        """All copies back to the model's start, time 0."""
        super().reset()
        self._kept[:] = 0.0

    def set_state(self, qpos: object, qvel: object) -> None:
        """Joints' positions (nq,) and velocities (nv,), or (copies, ..); None: as they are."""
        for name, value, size in (("qpos", qpos, self.model.nq), ("qvel", qvel, self.model.nv)):
            if value is not None:
                lead = (self.copies,) if np.asarray(value).ndim == 2 else ()
                self.bound(name)[:] = as_array(name, value, (*lead, size))

    def snapshot(self) -> Array:
        """What is kept of late sensors, then the full integration state (copies, n)."""
        return np.hstack([self._kept, super().snapshot()])

    def restore(self, snapshot: Array) -> None:
        """Continue from a snapshot, bit for bit.

        Raises:
            InvalidArgumentError: another shape.
        """
        kept = self._kept.shape[1]
        super().restore(snapshot[:, kept:])
        self._kept[:] = snapshot[:, :kept]

    def current_signals(self) -> Array:
        """Signals (copies, n_signals) of the state as it is, late ones as they would be heard."""
        found: Array = self.sensors_now()[:, self.adopted.signals].copy()
        found[:, self.adopted.late] = self._recorded_late
        return found

    # --- stepping ----------------------------------------------------------------------------

    def prepare(self, drive: Drive) -> None:
        """Set gates and pushes, and clear old inputs, before the first chunk of a drive."""
        super().prepare(drive)
        self.bound("xfrc_applied")[:] = 0.0 if drive.pushes is None else drive.pushes

    def run(self, drive: Drive, record: tuple[str, ...], start: int, stop: int) -> dict[str, Array]:
        """Steps start .. stop - 1 of a drive; returns the recorded arrays.

        Raises:
            DivergenceError: a copy blew up.
            McmjError: another package's callback is installed.
        """
        states = [name for name in ("qpos", "qvel") if name in record]
        before = {name: self.bound(name).copy() for name in states}
        late = int(self.adopted.late.sum())
        if late:  # for the law: a batch keeps sensors of the copy that it stepped last only
            memory = self.bound("userdata")[:, self.adopted.memory :]
            memory[:, 0], memory[:, 1 : 1 + late] = 1.0, self._kept[:, :late]
        sensors = ["sensordata"] if late or {"signals", "sensordata"} & set(record) else []
        rows = self._advance(drive, start, stop, [*states, *sensors])
        found: dict[str, Any] = {name: shifted(before[name], rows[name]) for name in states}
        if sensors:
            found |= {"signals": self._signals(rows["sensordata"])}
            found |= {"sensordata": rows["sensordata"]}
            self._kept = rows["sensordata"][:, -1, self.adopted.kept]
        return {name: found[name] for name in record}

    @property
    def _recorded_late(self) -> Array:
        """Late signals (copies, n) as they are recorded at the next step: without a delay."""
        late = int(self.adopted.late.sum())
        return self._kept[:, self._kept.shape[1] - late :]

    def _signals(self, sensordata: Array) -> Array:
        """Signals (copies, T, n_signals) as the law heard them, but for a delay."""
        signals, late = sensordata[..., self.adopted.signals], self.adopted.late
        if late.any():
            signals[..., late] = shifted(self._recorded_late, signals[..., late])
        return signals
