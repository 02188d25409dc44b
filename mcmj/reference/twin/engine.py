"""The compiled twin with the interface of MuJoCo's engine: Simulation(engine="twin")."""

from typing import Any

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body, spring_lengths
from mcmj.core.integrators import TWINNED
from mcmj.core.options import Options
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State
from mcmj.reference.twin.population import Population, rest
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_count


class TwinEngine:
    """Copies of one body under a compiled twin; see Simulation for the options.

    Records signals only: positions and velocities are MuJoCo's to show.
    """

    recordable: tuple[str, ...] = ("signals",)

    def __init__(self, body: Body, options: Options, *, copies: int, threads: int) -> None:
        require_count("copies", copies, 1)
        timestep, integrator = options.timestep, options.integrator
        self.body, self.options = body, options
        self.timestep, self.integrator = timestep, integrator
        self.copies = copies
        self._population = Population(
            [body] * copies,
            [None] * copies,
            method=TWINNED[integrator].twin,
            timestep=timestep,
            threads=threads,
            packed=copies >= 4,
        )

    @property
    def steps_done(self) -> int:
        """Control steps since the start."""
        return self._population.steps_done

    def reset(self) -> None:
        """All copies back to the start, at rest, time 0."""
        self._population.set_states([rest(self.body)] * self.copies)
        self._population.steps_done = 0

    @property
    def alive(self) -> npt.NDArray[np.bool_]:
        """(copies,) all: one that blows up is an error."""
        return np.ones(self.copies, np.bool_)

    def leave_behind(self) -> None:
        """As `model`."""
        raise InvalidArgumentError("lenient", "False with engine 'twin'", "True")

    def set_readout(self, w_out: Array | None) -> None:
        """Readouts (rows, n_outputs) for all copies, or (copies, rows, n_outputs)."""
        one_each = [w_out] * self.copies if w_out is None or w_out.ndim == 2 else list(w_out)
        self._population.set_readouts(one_each)

    @property
    def state(self) -> State:
        """Positions and velocities (copies, N, 2) now."""
        states = self._population.states
        return State(
            positions=np.array([s.positions for s in states]),
            velocities=np.array([s.velocities for s in states]),
            time=states[0].time,
        )

    def set_state(self, positions: object, velocities: object) -> None:
        """Positions and velocities (N, 2) for all copies, or (copies, N, 2); None: as they are."""
        now = self.state
        arrays = {"positions": now.positions, "velocities": now.velocities}
        for name, value in (("positions", positions), ("velocities", velocities)):
            if value is not None:
                lead = (self.copies,) if np.asarray(value).ndim == 3 else ()
                given = as_array(name, value, (*lead, self.body.n_nodes, 2))
                arrays[name] = np.where(self.body.fixed[:, None], arrays[name], given)
        pairs = zip(arrays["positions"], arrays["velocities"], strict=True)
        self._population.set_states([State(p, v) for p, v in pairs])

    def snapshot(self) -> Array:
        """Full state (copies, n): all that `restore` needs."""
        parts = [part.reshape(self.copies, -1) for part in self._population.kernel_state]
        return np.hstack([*parts, np.full((self.copies, 1), float(self.steps_done))])

    def restore(self, snapshot: Array) -> None:
        """Continue from a snapshot, bit for bit."""
        parts = self._population.kernel_state
        sizes = [part[0].size for part in parts]
        if np.shape(snapshot) != (self.copies, sum(sizes) + 1):
            raise InvalidArgumentError(
                "snapshot", f"shape {(self.copies, sum(sizes) + 1)}", f"shape {np.shape(snapshot)}"
            )
        pieces = np.split(snapshot[:, :-1], np.cumsum(sizes)[:-1], axis=1)
        for part, piece in zip(parts, pieces, strict=True):
            part[:] = piece.reshape(part.shape)  # NaN marks an empty leapfrog history
        self._population.steps_done = int(snapshot[0, -1])

    @property
    def model(self) -> Any:
        """There is none: nothing of MuJoCo's can be asked for or altered.

        Raises:
            InvalidArgumentError: always.
        """
        raise InvalidArgumentError("engine", "'mujoco', which has a model", "'twin'")

    def bound(self, name: str) -> Array:
        """As `model`."""
        raise InvalidArgumentError("engine", f"'mujoco', which has {name}", "'twin'")

    def alter(self, cut: object, masses: object) -> None:
        """As `model`."""
        raise InvalidArgumentError("engine", "'mujoco' for bodies that change", "'twin'")

    def pushes(self, forces: object) -> Array:
        """As `model`."""
        raise InvalidArgumentError("forces", "(N,) or (T, N) on a body's nodes", "names")

    def current_signals(self) -> Array:
        """Spring lengths (copies, L) [m] at the current state."""
        return spring_lengths(self.state.positions, self.body.springs)

    def prepare(self, drive: Drive) -> None:
        """Nothing to do: the drive goes with every run."""

    def run(self, drive: Drive, record: tuple[str, ...], start: int, stop: int) -> dict[str, Array]:
        """Control steps start .. stop - 1 of a drive; returns the recorded arrays.

        Raises:
            DivergenceError: a copy blew up.
        """
        taken, done = self._population.run(drive, start, stop, lengths="signals" in record)
        dead = np.flatnonzero(done < stop - start)
        if dead.size:
            copy = int(dead[0])
            raise self._population.divergence(copy, int(done[copy]), stop - start)
        return {"signals": taken.lengths} if "signals" in record else {}
