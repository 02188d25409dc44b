"""Any MuJoCo model that computes: a readout of its sensors drives its actuators, inside the step.

    y(k) = W^T s(k) + b,    ctrl of an actuator = gain (gate_c y_c(k) + offset_c(k)) + inputs

s(k) are the sensors at the start of step k, also under RK4. What MuJoCo computes after actuation
only (forces, accelerations) is heard as it was one step before; `signals` show what was heard.
Inputs, offset, forces and the fed-back outputs are held over the step, also inside the stages
of RK4.
"""

import copy
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, Self

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.core.readout import Readout, is_pair, readout_rows
from mcmj.core.rollout_arguments import Drive, check_drive
from mcmj.core.trajectory import Trajectory, join
from mcmj.simulation.damage import check_model_damage
from mcmj.simulation.engines import Engine
from mcmj.simulation.model_engine import ModelEngine
from mcmj.simulation.models.adopt import Model, adopt, read_spec
from mcmj.simulation.models.names import Channels
from mcmj.simulation.models.reservoir_file import read_reservoir, write_reservoir
from mcmj.simulation.one_drive import OneDrive
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count

CHUNK = 16384  # control steps at a time in C: 8 MB of 61 signals

Hook = Callable[[float, Array], Array]


class Reservoir(OneDrive):
    """A MuJoCo model as a reservoir; its state carries over from one rollout to the next.

    Args:
        model: MJCF as a path or a string, an MjSpec or an MjModel; it is copied.
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
        copies: independent copies, each with its own state and, if given, readout, inputs and
            offset; all arrays then have the copies as their first axis.
        threads: that they run on; results do not depend on it.

    Raises:
        BodyFileError: no such file, or not a model.
        InvalidArgumentError, UnknownNameError: an argument out of bounds, an unknown name.
    """

    _engine: Engine
    _copies: int | None = None
    _aliases: ClassVar[dict[str, str]] = {}  # what users call what is recorded

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
        copies: int | None = None,
        threads: int = 1,
    ) -> None:
        self._adopted = adopt(
            read_spec(model, timestep, integrator),
            sensors,
            channels,
            inputs,
            feedback_delay,
            numbers=model if isinstance(model, mujoco.MjModel) else None,
        )
        engine = ModelEngine(self._adopted, copies=1 if copies is None else copies, threads=threads)
        self._begin(engine, w_out, copies)

    def _begin(self, engine: Engine, w_out: object, copies: int | None) -> None:
        self._engine, self._copies = engine, copies
        self._alterations: tuple[tuple[Sequence[Any], Any], ...] = ()
        self.set_readout(w_out)

    def with_copies(self, copies: int, threads: int = 1, *, lenient: bool = False) -> Self:
        """Independent copies of this reservoir at its start, cuts, masses and readout as they are.

        Args:
            lenient: copies that blow up are left behind, and `alive` says which; otherwise they
                are a DivergenceError. What is recorded of them after that means nothing.

        Raises:
            InvalidArgumentError: it has copies already, an argument out of bounds, or `lenient`
                with the compiled twin.
        """
        if self._copies is not None:
            raise InvalidArgumentError("reservoir", "one without copies", f"{self._copies}")
        other = copy.copy(self)
        other._driven = False
        other._begin(self._new_engine(copies, threads), self._w_out, copies)
        if lenient:
            other._engine.leave_behind()
        for cut, masses in self._alterations:
            other.alter(cut=cut, masses=masses)
        return other

    def _new_engine(self, copies: int, threads: int) -> Engine:
        return ModelEngine(self._adopted, copies=copies, threads=threads)

    @classmethod
    def open(cls, model: Model) -> Self:
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

    # --- what it is --------------------------------------------------------------------------

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's compiled model; readouts and gates of a rollout are not written to it.

        Raises:
            InvalidArgumentError: the engine is not MuJoCo.
        """
        return self._engine.model

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
    def late_signals(self) -> tuple[str, ...]:
        """Names of the signals that are heard as they were one step before."""
        pairs = zip(self.signal_names, self._adopted.late, strict=True)
        return tuple(name for name, late in pairs if late)

    @property
    def feedback_delay(self) -> int:
        """Steps between a signal and the force it feeds back."""
        return int(self._adopted.asked["feedback_delay"])

    @property
    def n_signals(self) -> int:
        """Number of signals that the readout hears."""
        return len(self.signal_names)

    @property
    def n_outputs(self) -> int:
        """Number of feedback channels."""
        return len(self.channel_names)

    @property
    def n_inputs(self) -> int:
        """Number of input channels."""
        return len(self.input_names)

    @property
    def n_forces(self) -> int:
        """Number of forces: degrees of freedom."""
        return int(self.model.nv)

    @property
    def copies(self) -> int | None:
        """Number of copies; None: one, without an axis for it."""
        return self._copies

    @property
    def timestep(self) -> float:
        """Control step [s]."""
        return self._engine.timestep

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self._engine.steps_done * self._engine.timestep

    # --- readout -----------------------------------------------------------------------------

    @property
    def w_out(self) -> Array | None:
        """The readout in use, as one array."""
        return self._w_out

    @property
    def readout(self) -> Readout:
        """The readout in use; without one, it always says 0."""
        if self._w_out is None:
            return Readout.of(None, self.n_signals, self.n_outputs)
        return Readout.from_rows(self._w_out, self.n_signals)

    def set_readout(self, w_out: object) -> None:
        """Replace the readout, from the next step on; None takes it away.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._w_out = None if w_out is None else self.checked_readout(w_out)
        self._engine.set_readout(self._w_out)

    def checked_readout(self, w_out: object) -> Array:
        """A readout as one array (n_signals, n_outputs), or with the bias as one row more.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        one = isinstance(w_out, Readout) or is_pair(w_out)
        if self._copies is None or one or np.asarray(w_out).ndim != 3:
            return readout_rows(w_out, self.n_signals, self.n_outputs)
        readouts = as_array("w_out", w_out, (self._copies, None, self.n_outputs))
        readout_rows(readouts[0], self.n_signals, self.n_outputs)  # all have the same shape
        return readouts

    # --- state -------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the start, at time 0."""
        self._engine.reset()

    def restart(self, qpos: object = None, qvel: object = None, act: object = None) -> None:
        """Time 0 in a state of MuJoCo's own coordinates; None: as at the start.

        Args:
            qpos, qvel, act: (nq,), (nv,), (na,) for all copies, or (copies, ..) for each.

        Raises:
            InvalidArgumentError: wrong shape, NaN, or the engine is not MuJoCo.
        """
        sizes = {"qpos": self.model.nq, "qvel": self.model.nv, "act": self.model.na}
        arrays = {}
        for name, value in (("qpos", qpos), ("qvel", qvel), ("act", act)):
            if value is not None:
                each = self._copies is not None and np.asarray(value).ndim == 2
                lead = (self._copies,) if each else ()
                arrays[name] = as_array(name, value, (*lead, sizes[name]))
        self._engine.reset()
        for name, array in arrays.items():
            self._engine.bound(name)[:] = array

    def set_state(self, qpos: object = None, qvel: object = None) -> None:
        """Put the joints at positions (nq,) and velocities (nv,), MuJoCo's units.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._engine.set_state(qpos, qvel)

    @property
    def qpos(self) -> Array:
        """MuJoCo's joint positions now (nq,)."""
        return self._public(self._engine.bound("qpos").copy())

    @property
    def qvel(self) -> Array:
        """MuJoCo's joint velocities now (nv,)."""
        return self._public(self._engine.bound("qvel").copy())

    @property
    def act(self) -> Array:
        """Activations of MuJoCo's actuators now (na,)."""
        return self._public(self._engine.bound("act").copy())

    @property
    def alive(self) -> npt.NDArray[np.bool_]:
        """(copies,): which have not blown up since the start; all, unless `lenient`."""
        return self._engine.alive.copy()

    @property
    def signals(self) -> Array:
        """What the readout would hear now (n_signals,)."""
        return self._public(self._engine.current_signals())

    def snapshot(self) -> Array:
        """The full integration state; `restore` continues from it bit for bit.

        Its last column is a number that only the same model and settings have.
        """
        state = self._engine.snapshot()
        return np.column_stack([state, np.full(len(state), self._fingerprint)])

    def restore(self, snapshot: Array) -> None:
        """Continue from a `snapshot` of a reservoir of the same model and settings.

        Raises:
            InvalidArgumentError: a snapshot of another model, time step or other setting.
        """
        values = np.asarray(snapshot)
        if values.ndim != 2 or (values[:, -1:] != self._fingerprint).any():
            raise InvalidArgumentError(
                "snapshot", f"one of {self._described()}", f"another, of shape {values.shape}"
            )
        self._engine.restore(values[:, :-1])

    def check_alteration(self, cut: Sequence[Any], masses: Any) -> None:
        """Raise unless `alter` can do this.

        Raises:
            InvalidArgumentError, UnknownNameError: no such tendon or body, or a wrong mass.
        """
        check_model_damage(self.model, cut, masses or {})

    def alter(self, *, cut: Sequence[Any] = (), masses: Any = None) -> None:
        """Cut tendons by name and change masses [kg] of bodies, {name: mass}, for good.

        Raises:
            InvalidArgumentError, UnknownNameError: no such tendon or body, or a wrong mass.
        """
        self.check_alteration(cut, masses)
        self._engine.alter(cut, masses)
        self._alterations += ((tuple(cut), copy.copy(masses)),)

    # --- stepping ----------------------------------------------------------------------------

    def rollout(
        self,
        steps: int | None = None,
        inputs: object = None,
        offset: object = None,
        gate: object = None,
        forces: object = None,
        *,
        record: Sequence[str] = ("signals", "outputs"),
        hook: Hook | None = None,
    ) -> Trajectory:
        """Advance by T control steps and return what was recorded.

        Args:
            steps: T; not needed if something is given over time.
            inputs: (T, n_inputs).
            offset: (T, n_outputs), added to the fed-back outputs; the teacher in teacher forcing.
            gate: (n_outputs,) or a number; default: 1 with a readout, else 0.
            forces: (n_forces,) or (T, n_forces): on the degrees of freedom [N or N m], of a body
                horizontally on its nodes [N]; or {body: (3,) [N]} constant, on bodies of a model.
            record: any of "signals", "outputs"; of a model also "qpos", "qvel", "sensordata"
                (all of its sensors), of a body "positions", "velocities".
            hook: slow (one Python call a control step): function (time, signals (n_signals,)) ->
                (n_forces,) forces during that step, for laws that nothing else covers.

        Raises:
            DivergenceError: the simulation blew up.
            InvalidArgumentError, UnknownNameError: an argument out of bounds.
        """
        return join(
            list(self.stream(steps, inputs, offset, gate, forces, record=record, hook=hook))
        )

    def stream(
        self,
        steps: int | None = None,
        inputs: object = None,
        offset: object = None,
        gate: object = None,
        forces: object = None,
        *,
        record: Sequence[str] = ("signals", "outputs"),
        hook: Hook | None = None,
        chunk: int = CHUNK,
    ) -> Iterator[Trajectory]:
        """As `rollout`, yielding chunks: memory stays flat however long the run is.

        Raises:
            McmjError: another stream or rollout of this simulation begins before this one is at
                its end or closed; also inside a hook.
        """
        wanted = frozenset("signals" if name == "lengths" else name for name in record)
        for name in wanted - {"outputs", *self._engine.recordable}:
            known = ["outputs", *self._engine.recordable]
            raise UnknownNameError("record", name, [self._aliases.get(n, n) for n in known])
        require_count("chunk", chunk, 1, MOST_STEPS)
        on_bodies = isinstance(forces, Mapping)
        drive = check_drive(
            self,
            steps=steps,
            inputs=inputs,
            offset=offset,
            gate=gate,
            forces=None if on_bodies else forces,
            closed=self._w_out is not None,
            copies=self._copies,
        )
        if isinstance(forces, Mapping):
            drive = replace(drive, pushes=self._engine.pushes(forces))
        return self._chunks(drive, wanted, hook, 1 if hook else chunk)

    # --- inside ------------------------------------------------------------------------------

    @cached_property
    def _fingerprint(self) -> float:
        """48 bits of a hash of the model and the settings, exact as a float."""
        digest = hashlib.blake2b(self._identity(), digest_size=6).digest()
        return float(int.from_bytes(digest))

    def _identity(self) -> bytes:
        binary = np.zeros(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, binary)
        return binary.tobytes()

    def _described(self) -> str:
        return "this model"

    def _public(self, array: Array) -> Array:
        """An engine's array as callers see it: one simulation has no axis of copies."""
        return array if self._copies is not None else array[0]

    def _chunks(
        self, drive: Drive, record: frozenset[str], hook: Hook | None, chunk: int
    ) -> Iterator[Trajectory]:
        with self._only_drive():
            self._engine.prepare(drive)
            for start in range(0, drive.steps, chunk):
                stop = min(start + chunk, drive.steps)
                now = self._with_hook(drive, hook, start) if hook else drive
                try:
                    chunk_run = self._run(now, record, start, stop)
                except DivergenceError as error:
                    raise error.after(start) from None
                yield chunk_run

    def _with_hook(self, drive: Drive, hook: Hook, step: int) -> Drive:
        """The drive with the hook's forces for this one step added."""
        if not callable(hook):
            raise InvalidArgumentError("hook", "a function (time, signals) -> forces", repr(hook))
        pushed = hook(self.time, self.signals)
        forces = as_array("hook's forces", pushed, (self.n_forces,))[None]
        if drive.forces is not None:
            row = min(step, drive.forces.shape[-2] - 1)
            forces = forces + drive.forces[..., row : row + 1, :]
        return replace(drive, forces=forces)

    def _run(self, drive: Drive, record: frozenset[str], start: int, stop: int) -> Trajectory:
        done = self._engine.steps_done
        times = self.timestep * np.arange(done, done + stop - start, dtype=np.float64)
        measured = record - {"outputs"} | ({"signals"} if "outputs" in record else set())
        arrays = self._engine.run(drive, tuple(sorted(measured)), start, stop)
        if "outputs" in record:
            arrays["outputs"] = self._outputs(arrays["signals"])
        public = {name: self._public(arrays[name]) for name in record}
        if "signals" in public:
            public["lengths"] = public.pop("signals")
        return Trajectory(times, final_state=self._final_state(), **public)

    def _final_state(self) -> Any:
        return None

    def _outputs(self, signals: Array) -> Array:
        """Outputs (copies, T, n_outputs); bits do not depend on the size of the chunks."""
        if self._w_out is None:
            return np.zeros((*signals.shape[:-1], self.n_outputs))
        return self.readout.outputs_by_row(signals)
