"""Any MuJoCo model that computes: a readout of its sensors drives its actuators, inside the step.

    y(k) = W^T s(k) + b,    ctrl of an actuator = gain (gate_c y_c(k) + offset_c(k)) + inputs

s(k) are the sensors at the start of step k, also under RK4. What MuJoCo computes after actuation
only (forces, accelerations) is heard as it was one step before; `signals` show what was heard.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.callbacks import install
from mcmj.core.readout import Readout, readout_rows
from mcmj.core.trajectory import Trajectory, join
from mcmj.simulation.adopted_model import (
    OURS,
    SETTINGS,
    Channels,
    Model,
    adopt,
    read_spec,
    stored,
)
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count

CHUNK = 16384  # control steps at a time in C
RECORDABLE = ("signals", "outputs", "qpos", "qvel")
_CTRL = mujoco.mjtState.mjSTATE_CTRL.value
_NO_STAGE = mujoco.mjtStage.mjSTAGE_NONE.value


class Reservoir:
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
        spec, given, w_out = stored(model)
        return cls(spec, **given, w_out=w_out)

    def to_mjcf(self) -> str:
        """The model as MJCF, with sensors, channels and readout: one file that is complete.

        Without mcmj it is the model with an open loop; MuJoCo's own viewer shows it. The readout
        is exact; the rest has the six digits that MuJoCo's writer keeps.
        """
        spec = self._adopted.spec.copy()
        rows, gate = self.readout.rows, float(self._w_out is not None)
        for c, name in enumerate(self.channel_names):
            actuator = spec.actuator(f"{OURS}output:{name}")
            actuator.userdata = rows[:, c]
            parameters = actuator.biasprm
            parameters[0] = gate
        kept = None if self._w_out is None else rows.tolist()
        text = next(text for text in spec.texts if text.name == SETTINGS)
        text.data = json.dumps({**json.loads(text.data), "w_out": kept})
        with quiet_warnings():
            spec.compile()
            return str(spec.to_xml())

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

    def reset(self, keyframe: int | str | None = None) -> None:
        """Back to the model's start, or to a keyframe of it, at time 0.

        Raises:
            InvalidArgumentError: no such keyframe.
        """
        self._batch.reset(stage=_NO_STAGE)
        if keyframe is not None:
            try:
                key = self.model.key(keyframe)
            except (KeyError, IndexError) as error:
                raise InvalidArgumentError("keyframe", "one of the model", keyframe) from error
            for name in ("qpos", "qvel", "act"):
                self._bound(name)[:] = getattr(key, name)
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
        """48 bits of a hash of the model, exact as a float."""
        xml = self._adopted.spec.to_xml().encode()
        return float(int.from_bytes(hashlib.blake2b(xml, digest_size=6).digest()))

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
        """As `rollout`, yielding chunks: memory stays flat however long the run is."""
        for name in record:
            if name not in (*RECORDABLE, "lengths"):
                raise UnknownNameError("record", name, RECORDABLE)
        require_count("chunk", chunk, 1, MOST_STEPS)
        series = {"inputs": (inputs, len(self.input_names)), "offset": (offset, self.n_outputs)}
        arrays = {
            name: as_array(name, value, (None, width))
            for name, (value, width) in series.items()
            if value is not None
        }
        total = _common_length(steps, arrays)
        if gate is None or np.asarray(gate).ndim == 0:
            gate = np.full(self.n_outputs, self._w_out is not None if gate is None else gate)
        gates = as_array("gate", gate, (self.n_outputs,))
        return self._chunks(total, arrays, gates, frozenset(record), chunk)

    def _bound(self, name: str) -> Array:
        """A view (1, n) of the simulation's data; making one costs as much as hundreds of steps."""
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
        arrays: dict[str, Array],
        gate: Array,
        record: frozenset[str],
        chunk: int,
    ) -> Iterator[Trajectory]:
        self._batch.expand("actuator_biasprm")[:, self._outputs_at, 0] = gate
        self._bound("ctrl")[:] = 0.0
        first = self._adopted.first
        for start in range(0, total, chunk):
            stop = min(start + chunk, total)
            control = None
            if arrays:
                control = np.zeros((stop - start, self.model.nu))
                for name, at in (("offset", first), ("inputs", first + self.n_outputs)):
                    if name in arrays:
                        rows = arrays[name][start:stop]
                        control[:, at : at + rows.shape[1]] = rows
            yield self._run(control, stop - start, record)

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


def _common_length(steps: int | None, arrays: dict[str, Array]) -> int:
    lengths = {name: len(array) for name, array in arrays.items()}
    if steps is None:
        if not lengths:
            expected = "a number of steps, or inputs or offset over time"
            raise InvalidArgumentError("steps", expected, None)
        steps = next(iter(lengths.values()))
    require_count("steps", steps, 1, MOST_STEPS)
    for name, length in lengths.items():
        if length != steps:
            raise InvalidArgumentError(name, f"{steps} rows, one a step", length)
    return int(steps)
