"""Rollouts of a body in MuJoCo; the loop runs wholly in C, no Python per step.

Two conventions hold under every integrator:

- lengths[k] are at t_k, before step k;
- inputs, offset, forces and the fed-back outputs are held over the step, also inside the
  stages of RK4.
"""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import cached_property

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.options import Options
from mcmj.core.readout import Readout, checked_readout
from mcmj.core.rollout_arguments import Drive, check_drive
from mcmj.core.trajectory import RECORDABLE, State, Trajectory, join
from mcmj.simulation.damage import checked_cut, checked_masses
from mcmj.simulation.engines import make_engine
from mcmj.simulation.mujoco_engine import Engine
from mcmj.simulation.one_drive import OneDrive
from mcmj.simulation.stepsize.limit import warn_if_unstable
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count

CHUNK = 16384  # control steps at a time in C: 8 MB of lengths at 61 springs

Hook = Callable[[float, Array], Array]


class Simulation(OneDrive):
    """A body in MuJoCo; its state carries over from one rollout to the next.

    Args:
        body: the body.
        w_out: readout (L, n_outputs), or (L + 1, n_outputs) with a bias in the last row; a pair
            of weights and bias, or a Readout.
        timestep: control step [s]: inputs, feedback and records go at this pace.
        integrator: one of MuJoCo's: Euler, RK4, implicit, implicitfast, discrete; or leapfrog,
            of second order at Euler's cost (mcmj.core.callbacks.leapfrog).
        springs: "native" (MuJoCo's polynomial), "cubic" or "tansig" (compiled callback), or
            your own SpringLaw.
        feedback_delay: number of control steps between a length and the force it feeds back;
            the first that many outputs fed back are 0.
        substeps: physics steps in a control step.
        engine: "mujoco", or "twin" for the compiled twin (Euler, RK4, leapfrog; native springs,
            no delay, no substeps, no positions recorded), tens of times faster, for screening.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """

    _copies: int | None = None  # an ensemble's arrays have a leading axis

    def __init__(
        self,
        body: Body,
        *,
        w_out: object = None,
        timestep: float = 1e-3,
        integrator: str = DEFAULT_INTEGRATOR,
        springs: str | SpringLaw = "native",
        feedback_delay: int = 0,
        substeps: int = 1,
        engine: str = "mujoco",
    ) -> None:
        options = Options(timestep, integrator, springs, feedback_delay, substeps, engine)
        self._engine = make_engine(body, options, copies=1, threads=1)
        warn_if_unstable(body, options)
        self.set_readout(w_out)

    @property
    def body(self) -> Body:
        """The body that is simulated."""
        return self._engine.body

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's compiled model; readouts and gates of a rollout are not written to it.

        Raises:
            InvalidArgumentError: the engine is not MuJoCo.
        """
        if not isinstance(self._engine, Engine):
            raise InvalidArgumentError("engine", "'mujoco', which has a model", "'twin'")
        return self._engine.model

    @property
    def timestep(self) -> float:
        """Control step [s]."""
        return self._engine.timestep

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self._engine.steps_done * self._engine.timestep

    @property
    def w_out(self) -> Array | None:
        """The readout in use, as one array."""
        return self._w_out

    @property
    def readout(self) -> Readout:
        """The readout in use; without one, it always says 0."""
        if self._w_out is None:
            return Readout.of(None, self.body.n_springs, self.body.n_outputs)
        return Readout.from_rows(self._w_out, self.body.n_springs)

    def set_readout(self, w_out: object) -> None:
        """Replace the readout, from the next step on; None takes it away.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._w_out = None if w_out is None else self._checked_readout(w_out)
        self._engine.set_readout(self._w_out)

    def alter(self, *, cut: Sequence[int] = (), masses: object = None) -> None:
        """Cut springs and change masses (N,) [kg], for good; `body` stays what it was.

        Raises:
            InvalidArgumentError: no such spring, a wrong mass, or the engine is the twin.
        """
        springs = checked_cut(self.body, cut)
        weights = None if masses is None else checked_masses(self.body, masses)
        if not isinstance(self._engine, Engine):
            raise InvalidArgumentError("engine", "'mujoco' for bodies that change", "'twin'")
        self._engine.alter(springs, weights)

    def reset(self) -> None:
        """Back to the start: the body's positions, at rest, time 0."""
        self._engine.reset()

    @property
    def state(self) -> State:
        """Positions, velocities and time now."""
        state = self._engine.state
        return replace(
            state,
            positions=self._public(state.positions),
            velocities=self._public(state.velocities),
        )

    def set_state(self, positions: object = None, velocities: object = None) -> None:
        """Put the nodes at positions and velocities (N, D) [m], [m/s]; fixed nodes stay.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._engine.set_state(positions, velocities)

    def snapshot(self) -> Array:
        """The full integration state; `restore` continues from it bit for bit.

        Its last column is a number that only the same body and settings have.
        """
        state = self._engine.snapshot()
        return np.column_stack([state, np.full(len(state), self._fingerprint)])

    def restore(self, snapshot: Array) -> None:
        """Continue from a `snapshot` of a simulation of the same body and settings.

        Raises:
            InvalidArgumentError: a snapshot of another body, time step or other setting.
        """
        values = np.asarray(snapshot)
        if values.ndim != 2 or (values[:, -1:] != self._fingerprint).any():
            raise InvalidArgumentError(
                "snapshot", f"one of {self.body!r} and these settings: {self._engine.options}",
                f"another, of shape {values.shape}",
            )  # fmt: skip
        self._engine.restore(values[:, :-1])

    def rollout(
        self,
        steps: int | None = None,
        inputs: object = None,
        offset: object = None,
        gate: object = None,
        forces: object = None,
        *,
        record: Sequence[str] = ("lengths", "outputs"),
        hook: Hook | None = None,
    ) -> Trajectory:
        """Advance by T control steps and return what was recorded.

        Args:
            steps: T; not needed if something is given over time.
            inputs: (T, n_inputs).
            offset: (T, n_outputs), added to the fed-back outputs; the teacher in teacher forcing.
            gate: (n_outputs,) or a number; default: 1 with a readout, else 0.
            forces: (N,) or (T, N) forces on the nodes along the body's direction, x [N].
            record: any of "lengths", "outputs", "positions", "velocities".
            hook: slow (one Python call a control step): function (time, lengths (L,)) -> (N,)
                such forces [N] during that step, for laws that nothing else covers.

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
        record: Sequence[str] = ("lengths", "outputs"),
        hook: Hook | None = None,
        chunk: int = CHUNK,
    ) -> Iterator[Trajectory]:
        """As `rollout`, yielding chunks: memory stays flat however long the run is.

        Raises:
            McmjError: another stream or rollout of this simulation begins before this one is at
                its end or closed; also inside a hook.
        """
        for name in record:
            if name not in RECORDABLE:
                raise UnknownNameError("record", name, RECORDABLE)
        require_count("chunk", chunk, 1, MOST_STEPS)
        drive = check_drive(
            self.body,
            steps=steps,
            inputs=inputs,
            offset=offset,
            gate=gate,
            forces=forces,
            closed=self._w_out is not None,
            copies=self._copies,
        )
        return self._chunks(drive, frozenset(record), hook, 1 if hook else chunk)

    # --- inside ------------------------------------------------------------------------------

    @cached_property
    def _fingerprint(self) -> float:
        """48 bits of a hash of the body's arrays and the settings, exact as a float."""
        options = self._engine.options
        name = getattr(options.springs, "name", options.springs)
        digest = hashlib.blake2b(repr(replace(options, springs=name)).encode(), digest_size=6)
        for field in fields(self.body):
            if field.name == "direction" and self.body.pushed_along_x:
                continue  # as before there was one
            array = getattr(self.body, field.name)
            digest.update(repr(array.shape).encode() + array.tobytes())
        return float(int.from_bytes(digest.digest()))

    def _checked_readout(self, w_out: object) -> Array:
        return checked_readout(self.body, w_out)

    def _public(self, array: Array) -> Array:
        """An engine's array as callers see it: one simulation has no axis of copies."""
        found: Array = array[0]
        return found

    def _chunks(
        self, drive: Drive, record: frozenset[str], hook: Hook | None, chunk: int
    ) -> Iterator[Trajectory]:
        with self._only_drive():
            self._engine.prepare(drive)
            for start in range(0, drive.steps, chunk):
                stop = min(start + chunk, drive.steps)
                now = _with_hook(drive, hook, start, self) if hook else drive
                try:
                    chunk_run = self._run(now, record, start, stop)
                except DivergenceError as error:
                    raise error.after(start) from None
                yield chunk_run

    def _run(self, drive: Drive, record: frozenset[str], start: int, stop: int) -> Trajectory:
        done = self._engine.steps_done
        times = self.timestep * np.arange(done, done + stop - start, dtype=np.float64)
        measured = record - {"outputs"} | ({"lengths"} if "outputs" in record else set())
        arrays = self._engine.run(drive, tuple(sorted(measured)), start, stop)
        if "outputs" in record:
            arrays["outputs"] = self._outputs(arrays["lengths"])
        public = {name: self._public(arrays[name]) for name in record}
        return Trajectory(times, final_state=self.state, **public)

    def _outputs(self, lengths: Array) -> Array:
        """Outputs (copies, T, n_outputs); bits do not depend on the size of the chunks."""
        if self._w_out is None:
            return np.zeros((*lengths.shape[:-1], self.body.n_outputs))
        return self.readout.outputs_by_row(lengths)


def _with_hook(drive: Drive, hook: Hook, step: int, simulation: Simulation) -> Drive:
    """The drive with the hook's forces for this one step added."""
    lengths = simulation._public(simulation._engine.current_lengths())
    if not callable(hook):
        raise InvalidArgumentError("hook", "a function (time, lengths) -> forces", repr(hook))
    pushed = hook(simulation.time, lengths)
    forces = as_array("hook's forces", pushed, (simulation.body.n_nodes,))[None]
    if drive.forces is not None:
        row = min(step, drive.forces.shape[-2] - 1)
        forces = forces + drive.forces[..., row : row + 1, :]
    return replace(drive, forces=forces)
