"""Any MuJoCo model that computes: a readout of its sensors drives its actuators, inside the step.

    y(k) = W^T s(k) + b,    ctrl of an actuator = gain (gate_c y_c(k) + offset_c(k)) + inputs

s(k) are the sensors at the start of step k, also under RK4. What MuJoCo computes after actuation
only (forces, accelerations) is heard as it was one step before; `signals` show what was heard.
"""

import hashlib
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.callbacks import install
from mcmj.core.readout import Readout, readout_rows
from mcmj.core.rollout_arguments import common_length, series
from mcmj.core.trajectory import Trajectory, join
from mcmj.simulation.adopted_model import Channels, Model, adopt, read_spec
from mcmj.simulation.one_drive import OneDrive
from mcmj.simulation.reservoir_file import read_reservoir, write_reservoir
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count

CHUNK = 16384  # control steps at a time in C
RECORDABLE = ("signals", "outputs", "qpos", "qvel")
_CTRL = mujoco.mjtState.mjSTATE_CTRL.value
_NO_STAGE = mujoco.mjtStage.mjSTAGE_NONE.value


class Reservoir(OneDrive):
    """A MuJoCo model as a reservoir; its state carries over from one rollout to the next.

    Args:
        model: MJCF as a path or a string, or an MjSpec; it is copied.
        sensors: names or glob patterns of sensors, in order; a vector gives one signal a
            component. What the model has no sensor for is asked for by kind and object:
            "jointpos:hip_*", "jointvel:*", "tendonpos:*", "actuatorfrc:*".
        channels: names or patterns of actuators, one output each; or the gains of the actuators
            that an output drives, {"y": {"left": 1.0, "right": -1.0}}.
        inputs: what inputs drive, the same way.
        w_out: readout (n_signals, n_channels), or with a bias as one row more.
        timestep: [s]; default: the model's.
        integrator: Euler, RK4, implicit, implicitfast, discrete; default: the model's.
        feedback_delay: steps between a signal and the force it feeds back; the first that many
            outputs fed back are 0.

    Raises:
        BodyFileError: no such file, or not a model.
        InvalidArgumentError, UnknownNameError: an argument out of bounds, an unknown name.
    """

    def __init__(
        self,
        model: Model,
        *,
        sensors: str | Sequence[str],
        channels: Channels,
        inputs: Channels = (),
        w_out: object = None,
        timestep: float | None = None,
        integrator: str | None = None,
        feedback_delay: int = 0,
    ) -> None:
        spec = read_spec(model, timestep, integrator)
        self._adopted = adopt(spec, sensors, channels, inputs, feedback_delay)
        install.install_control()
        self._batch = Batch(self.model, 1, 1)
        self._views: dict[str, Array] = {}
        self.steps_done = 0
        self.reset()
        self.set_readout(w_out)

    @classmethod
    def open(cls, model: Model) -> "Reservoir":
        """A reservoir from its file, with its readout; see `to_mjcf`.

        Raises:
            BodyFileError: no such file, or not that of a reservoir.
        """
        spec, asked, w_out = read_reservoir(model)
        return cls(spec, **asked, w_out=w_out)

    def to_mjcf(self) -> str:
        """The model as MJCF, with sensors, channels and readout: one file that is complete.

        Without mcmj it is the model with an open loop; MuJoCo's own viewer shows it. The readout
        is exact; the rest has the six digits that MuJoCo's writer keeps.
        """
        return write_reservoir(self._adopted, None if self._w_out is None else self.readout)

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model, with the channels that were added."""
        return self._adopted.model

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Of the components of all sensors."""
        return self._adopted.signal_names

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Of the outputs."""
        return self._adopted.channel_names

    @property
    def input_names(self) -> tuple[str, ...]:
        """Of the inputs."""
        return self._adopted.input_names

    @property
    def n_signals(self) -> int:
        """Number of signals that the readout hears."""
        return len(self._adopted.signals)

    @property
    def n_outputs(self) -> int:
        """Number of feedback channels."""
        return len(self.channel_names)

    @property
    def timestep(self) -> float:
        """Control and physics step [s]."""
        return float(self.model.opt.timestep)

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self.steps_done * self.timestep

    @property
    def w_out(self) -> Array | None:
        """The readout in use, as one array."""
        return self._w_out

    @property
    def readout(self) -> Readout:
        """The readout in use; without one, it always says 0."""
        return Readout.of(self._w_out, self.n_signals, self.n_outputs)

    def set_readout(self, w_out: object) -> None:
        """Replace the readout, from the next step on; None takes it away.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        given = w_out is not None
        self._w_out = readout_rows(w_out, self.n_signals, self.n_outputs) if given else None
        users = self._batch.expand("actuator_user")[:, self._outputs_at]
        users[:] = 0.0
        users[:, :, : self.n_signals + 1] = self.readout.rows.T

    # --- state -------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the model's start, time 0."""
        self._batch.reset(stage=_NO_STAGE)
        self.steps_done = 0
        self._heard_late = np.zeros(int(self._adopted.late.sum()))

    def set_state(self, qpos: object = None, qvel: object = None) -> None:
        """Put the joints at positions (nq,) and velocities (nv,).

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        for name, value, size in (("qpos", qpos, self.model.nq), ("qvel", qvel, self.model.nv)):
            if value is not None:
                self._bound(name)[:] = as_array(name, value, (size,))

    def snapshot(self) -> Array:
        """All that `restore` needs to continue from here, bit for bit."""
        own = [float(self.steps_done), *self._heard_late, self._fingerprint]
        return np.concatenate([self._batch.state[0], own])

    def restore(self, snapshot: Array) -> None:
        """Continue from a `snapshot` of a reservoir of the same model and settings.

        Raises:
            InvalidArgumentError: a snapshot of another one.
        """
        values, n = np.asarray(snapshot), self._batch.nstate
        late = len(self._heard_late)
        if values.shape != (n + late + 2,) or values[-1] != self._fingerprint:
            raise InvalidArgumentError("snapshot", "one of this model", f"shape {values.shape}")
        self._batch.state[:] = values[:n]
        self.steps_done, self._heard_late = int(values[n]), values[n + 1 : -1].copy()
        if late:  # the law puts them back, see mcmj.core.callbacks.reservoir_law
            memory = self._bound("userdata")[0, self._adopted.memory :]
            memory[0], memory[1 : 1 + late] = 1.0, self._heard_late

    @cached_property
    def _fingerprint(self) -> float:
        """48 bits of a hash of the compiled model, exact as a float."""
        binary = np.zeros(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, binary)
        return float(int.from_bytes(hashlib.blake2b(binary.tobytes(), digest_size=6).digest()))

    # --- stepping ----------------------------------------------------------------------------

    def rollout(
        self,
        steps: int | None = None,
        inputs: object = None,
        offset: object = None,
        gate: object = None,
        *,
        record: Sequence[str] = ("signals", "outputs"),
    ) -> Trajectory:
        """Advance by T steps and return what was recorded.

        Args:
            steps: T; not needed if something is given over time.
            inputs: (T, n_inputs).
            offset: (T, n_channels), added to the fed-back outputs: the teacher in teacher forcing.
            gate: (n_channels,) or a number; default: 1 with a readout, else 0.
            record: any of "signals", "outputs", "qpos", "qvel".

        Raises:
            DivergenceError: the simulation blew up.
            InvalidArgumentError, UnknownNameError: an argument out of bounds.
        """
        return join(list(self.stream(steps, inputs, offset, gate, record=record)))

    def stream(
        self,
        steps: int | None = None,
        inputs: object = None,
        offset: object = None,
        gate: object = None,
        *,
        record: Sequence[str] = ("signals", "outputs"),
        chunk: int = CHUNK,
    ) -> Iterator[Trajectory]:
        """As `rollout`, yielding chunks: memory stays flat however long the run is.

        Raises:
            McmjError: another stream or rollout of this reservoir is not at its end.
        """
        for name in record:
            if name not in (*RECORDABLE, "lengths"):  # which lessons call signals
                raise UnknownNameError("record", name, RECORDABLE)
        require_count("chunk", chunk, 1, MOST_STEPS)
        arrays = {
            "inputs": series("inputs", inputs, len(self.input_names)),
            "offset": series("offset", offset, self.n_outputs),
        }
        total = common_length(steps, arrays)
        if gate is None or np.asarray(gate).ndim == 0:
            gate = np.full(self.n_outputs, self._w_out is not None if gate is None else gate)
        gates = as_array("gate", gate, (self.n_outputs,))
        return self._chunks(total, arrays, gates, frozenset(record), chunk)

    def _bound(self, name: str) -> Array:
        """A view (1, n) of the simulation's data, made once: making one is slow."""
        if name not in self._views:
            self._views[name] = self._batch.bind(name)
        return self._views[name]

    @property
    def _outputs_at(self) -> slice:
        """The actuators of the outputs."""
        return slice(self._adopted.first, self._adopted.first + self.n_outputs)

    def _chunks(
        self,
        total: int,
        arrays: dict[str, Array | None],
        gate: Array,
        record: frozenset[str],
        chunk: int,
    ) -> Iterator[Trajectory]:
        with self._only_drive():
            self._batch.expand("actuator_biasprm")[:, self._outputs_at, 0] = gate
            self._bound("ctrl")[:] = 0.0
            for start in range(0, total, chunk):
                stop = min(start + chunk, total)
                yield self._run(self._control(arrays, start, stop), stop - start, record)

    def _control(self, arrays: dict[str, Array | None], start: int, stop: int) -> Array | None:
        """ctrl (steps, nu) of the channels; None if nothing varies."""
        control, first = np.zeros((stop - start, self.model.nu)), self._adopted.first
        for name, at in (("offset", first), ("inputs", first + self.n_outputs)):
            rows = arrays[name]
            if rows is not None:
                control[:, at : at + rows.shape[1]] = rows[start:stop]
        return control if any(rows is not None for rows in arrays.values()) else None

    def _run(self, control: Array | None, steps: int, record: frozenset[str]) -> Trajectory:
        install.install_control()  # somebody may have taken it out since the last chunk
        batch = self._batch
        before = {name: self._bound(name).copy() for name in ("qpos", "qvel", "time")}
        states = record & {"qpos", "qvel"}
        with quiet_warnings():
            rows = batch.rollout(steps, control, _CTRL, ["sensordata", *states])
        self._check_alive(before["time"][0], steps)
        signals = self._signals(rows["sensordata"][0])
        times = self.timestep * np.arange(self.steps_done, self.steps_done + steps, dtype=float)
        self.steps_done += steps
        found: dict[str, Any] = {
            name: np.vstack([before[name], rows[name][0]])[:-1] for name in states
        }
        if "outputs" in record:
            found["outputs"] = self.readout.outputs_by_row(signals)
        if record & {"signals", "lengths"}:
            found["lengths"] = signals
        return Trajectory(times, **found)

    def _signals(self, sensordata: Array) -> Array:
        """Signals (T, n_signals) as the law heard them."""
        signals, late = sensordata[:, self._adopted.signals], self._adopted.late
        if late.any():
            now = signals[:, late]
            signals[:, late] = np.vstack([self._heard_late, now])[:-1]
            self._heard_late = now[-1].copy()
        return signals

    def _check_alive(self, time_before: float, steps: int) -> None:
        """Raise if MuJoCo stopped early or a number is not finite."""
        time, speeds = float(self._bound("time")[0]), self._bound("qvel")[0]
        done = round((time - time_before) / self.timestep)
        if done >= steps and np.isfinite(speeds).all():
            return
        dof = int(np.nan_to_num(np.abs(speeds), nan=np.inf).argmax())
        joint = self.model.joint(int(self.model.dof_jntid[dof])).name
        self.steps_done += done
        raise DivergenceError(
            f"the simulation blew up after t = {time:.6g} s at joint {joint!r} (speed "
            f"{speeds[dof]:.3g}), step {1e3 * self.timestep:g} ms; try a smaller step, another "
            "integrator, or smaller outputs",
            time=time,
            steps_done=done,
        )
