"""Rollouts of a readout in the loop, whichever engine steps: what bodies and models share.

    y(k) = W^T s(k) + b,    fed back: gate_c y_c(k) + offset_c(k)

Two conventions hold under every integrator: signals[k] are at t_k, before step k; inputs, offset,
forces and the fed-back outputs are held over the step, also inside the stages of RK4.
"""

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from mcmj.core.readout import Readout, is_pair, readout_rows
from mcmj.core.rollout_arguments import Drive, check_drive
from mcmj.core.trajectory import Trajectory, join
from mcmj.simulation.engines import Engine
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjError, UnknownNameError
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count

CHUNK = 16384  # control steps at a time in C: 8 MB of 61 signals

Hook = Callable[[float, Array], Array]


class Loop(ABC):
    """A system with a readout, stepped by an engine; the state carries over between rollouts."""

    _engine: Engine
    _copies: int | None = None
    _driven = False  # a stream has begun and is not at its end
    _aliases: ClassVar[dict[str, str]] = {}  # what users call what is recorded

    def __repr__(self) -> str:
        copies = "" if self._copies is None else f", {self._copies} copies"
        return (
            f"{type(self).__name__}({self.n_signals} signals, {self.n_outputs} outputs, "
            f"{self.n_inputs} inputs{copies}, at {self.time:g} s)"
        )

    def _begin(self, engine: Engine, w_out: object, copies: int | None) -> None:
        self._engine, self._copies = engine, copies
        self.set_readout(w_out)

    @property
    @abstractmethod
    def signal_names(self) -> tuple[str, ...]:
        """What the readout hears, component by component."""

    @property
    @abstractmethod
    def channel_names(self) -> tuple[str, ...]:
        """What the outputs drive."""

    @property
    @abstractmethod
    def input_names(self) -> tuple[str, ...]:
        """What the inputs drive."""

    @property
    @abstractmethod
    def n_forces(self) -> int:
        """Number of forces that a rollout takes."""

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
    def copies(self) -> int | None:
        """Number of copies; None: one, without an axis for it."""
        return self._copies

    def _require_one(self) -> None:
        """Raise if there are copies.

        Raises:
            InvalidArgumentError: there are.
        """
        if self._copies is not None:
            raise InvalidArgumentError("reservoir", "one without copies", f"{self._copies}")

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
                "snapshot", f"one of {self._described()}",
                f"that of another (shape {values.shape}); a file keeps six digits of a model",
            )  # fmt: skip
        self._engine.restore(values[:, :-1])

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
            forces: (n_forces,) or (T, n_forces): on the degrees of freedom [N or N m]; of a body
                along its direction on its nodes [N]; or, of a model, {body: (3,) [N]} constant,
                (copies, 3) where they differ.
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
        names = (record,) if isinstance(record, str) else record
        wanted = frozenset("signals" if name == "lengths" else name for name in names)
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

    @abstractmethod
    def _identity(self) -> bytes:
        """What only the same system and settings have."""

    @abstractmethod
    def _described(self) -> str:
        """The same, in words."""

    @contextmanager
    def _only_drive(self) -> Iterator[None]:
        """Refuse a second drive until the block ends.

        Raises:
            McmjError: one is at work.
        """
        if self._driven:
            raise McmjError(
                "a stream or rollout of this simulation is not at its end: finish it or close it "
                "(stream.close()), or use a simulation each"
            )
        self._driven = True
        try:
            yield
        finally:
            self._driven = False

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
