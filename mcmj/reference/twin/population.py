"""Many bodies, each with its own topology, parameters, readout and state, run in one call."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body, require_plane
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State
from mcmj.reference.twin.forces import Bodies
from mcmj.reference.twin.kernels import integrate_bodies
from mcmj.reference.twin.layout import (
    blank_unused,
    empty_record,
    to_bodies,
    to_kernel_state,
    to_packs,
    to_schedule,
    with_readouts,
)
from mcmj.reference.twin.packs import Packs, integrate_packs
from mcmj.reference.twin.stepping import (
    METHODS,
    KernelRun,
    KernelState,
    Record,
    scheme_of,
)
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array, require_count, require_number


class Population:
    """Bodies under a compiled twin, at first at rest; their states carry over from run to run.

    A body's bits depend neither on the other bodies nor on the number of threads. Bodies of
    one topology may be packed four to a vector register, which is faster and may differ from
    an unpacked run in the last digits.

    Args:
        bodies: planar, pushed along x, with the same numbers of channels.
        readouts: one each, in any form that Readout.of takes; None: none.
        method: one of METHODS.
        timestep: control and integration step [s].
        threads: number of threads.
        packed: pack them; all must have one topology. Not with adaptive_leapfrog, whose bodies
            take steps of their own.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        readouts: Sequence[object],
        *,
        method: str,
        timestep: float = 1e-3,
        threads: int = 1,
        packed: bool = False,
    ) -> None:
        if method not in METHODS:
            raise UnknownNameError("method", method, METHODS)
        require_number("timestep", timestep, 0.0, open_low=True)
        require_count("threads", threads, 1)
        if len(bodies) == 0:
            raise InvalidArgumentError("bodies", "at least one body", 0)
        for body in {id(body): body for body in bodies}.values():
            require_plane(body, "the compiled twins")
        self.bodies = list(bodies)
        self.method, self.timestep, self.threads = method, timestep, threads
        self._packed = packed and not scheme_of(method, timestep).adaptive
        self.steps_done = 0
        self.set_states([rest(body) for body in bodies])
        lay_out = to_packs if self._packed else to_bodies
        self._layout: Bodies | Packs = lay_out(self.bodies, readouts)

    def set_readouts(self, readouts: Sequence[object]) -> None:
        """Replace all readouts, from the next step on."""
        if isinstance(self._layout, Bodies):
            self._layout = with_readouts(self._layout, self.bodies, readouts)
        else:
            self._layout = to_packs(self.bodies, readouts)

    @property
    def kernel_state(self) -> KernelState:
        """The kernels' own arrays, bodies first; writing to them changes the state."""
        return self._state

    def set_states(self, states: Sequence[State]) -> None:
        """Replace all states."""
        self._state = to_kernel_state(self.bodies, states)

    @property
    def states(self) -> list[State]:
        """Every body's state, with what the toolbox schemes and the leapfrog remember."""
        time = self.steps_done * self.timestep
        return [
            State(
                positions=self._state.positions[b, : body.n_nodes].copy(),
                velocities=self._state.velocities[b, : body.n_nodes].copy(),
                time=time,
                previous_lengths=self._state.lengths[b, : body.n_springs].copy(),
                pending_output=self._state.outputs[b].copy(),
                history=self._history(b, body.n_nodes),
            )
            for b, body in enumerate(self.bodies)
        ]

    def _history(self, b: int, nodes: int) -> Array | None:
        if not scheme_of(self.method, self.timestep).leapfrog:
            return None
        return np.hstack([self._state.velocities[b, :nodes], self._state.history[b, :nodes]])

    def run(
        self, drive: Drive, start: int, stop: int, *, lengths: bool = True
    ) -> tuple[Record, npt.NDArray[np.int64]]:
        """Steps start .. stop - 1 of a drive for all bodies.

        Returns:
            record: lengths (B, T, L) if asked for, outputs (B, T, n_outputs), padded with NaN.
            done: (B,) finite steps; fewer than T where a body blew up.
        """
        steps = stop - start
        record = empty_record(self.bodies, steps, lengths=lengths)
        schedule = to_schedule(drive, start, stop)
        done = np.zeros(len(self.bodies), np.int64)
        kernel = integrate_packs if self._packed else integrate_bodies

        scheme = scheme_of(self.method, float(self.timestep))
        run = KernelRun(schedule, self._state, record, done, scheme, steps)

        def part(first: int, last: int) -> None:
            kernel(self._layout, run, first, last)

        count = len(self._layout.laws)
        share = max(1, count // (4 * self.threads))  # some calls a thread: all end together
        if self.threads == 1 or count == 1:
            part(0, count)
        else:
            with ThreadPoolExecutor(self.threads) as pool:
                firsts = range(0, count, share)
                list(pool.map(lambda first: part(first, min(first + share, count)), firsts))
        self.steps_done += steps
        blank_unused(record, self.bodies, done)
        return record, done

    def divergence(self, b: int, done: int, steps: int) -> DivergenceError:
        """The error that says how body b blew up after `done` of the last `steps` steps."""
        time = (self.steps_done - steps + done) * self.timestep
        which = f"body {b}: " if len(self.bodies) > 1 else ""
        speed = np.abs(self._state.velocities[b]).max(axis=1)
        node = int(np.nan_to_num(speed, nan=np.inf).argmax())
        return DivergenceError(
            f"{which}the simulation blew up after t = {time:.6g} s at node {node}, method "
            f"{self.method}, step {1e3 * self.timestep:g} ms; try a smaller step, or smaller "
            "forces and readout weights",
            time=time,
            steps_done=done,
        )


def rest(body: Body) -> State:
    """The body's start: its positions, at rest."""
    return State(body.positions, np.zeros_like(body.positions))
