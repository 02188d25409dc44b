"""A planar body in closed loop as a map of its state vector, for many copies at once.

    z_{k+1} = Phi(z_k, u_k),   z = (positions of the free nodes, their velocities), n = 4 x free

Phi is one step of the compiled twin of MuJoCo's Euler; z leaves nothing out, because the
readout is static and the outputs are fed back in the step in which they are read. (The leapfrog
has a memory. What a readout taught under it does under Euler differs by Euler's error.)
"""

from dataclasses import dataclass, replace

import numpy as np

from mcmj.analysis.loops.loop_map import LoopRun
from mcmj.core.body import Body, require_plane, spring_lengths
from mcmj.core.integrators import INTEGRATORS
from mcmj.core.readout import Readout, checked_readout
from mcmj.core.rollout_arguments import check_drive
from mcmj.core.trajectory import State
from mcmj.reference.twin.population import Population
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_count, require_number

INTEGRATOR = "Euler"
METHOD = INTEGRATORS[INTEGRATOR].twin


@dataclass(frozen=True)
class ClosedLoop:
    """A trained body under its own readout.

    Attributes:
        body: the body, planar and pushed along x.
        w_out: readout (L, n_outputs), or with a bias in the last row; None: open loop.
        timestep: control and physics step [s].
        threads: results do not depend on them.

    Raises:
        InvalidArgumentError: an argument out of bounds.
    """

    body: Body
    w_out: Array | None
    timestep: float = 1e-3
    threads: int = 1

    def __post_init__(self) -> None:
        require_plane(self.body, "the analysis of a closed loop")
        require_number("timestep", self.timestep, 0.0, open_low=True)
        require_count("threads", self.threads, 1)
        if self.w_out is not None:
            object.__setattr__(self, "w_out", checked_readout(self.body, self.w_out))

    @property
    def readout(self) -> Readout:
        """Of the loop; of an open one, it always says 0."""
        return Readout.of(self.w_out, self.body.n_springs, self.body.n_outputs)

    @property
    def size(self) -> int:
        """n, the dimension of the state."""
        return 4 * len(self.body.free)

    @property
    def velocities(self) -> slice:
        """Which of the coordinates are velocities."""
        return slice(self.size // 2, self.size)

    @property
    def n_forces(self) -> int:
        """Number of forces: N, horizontal ones on all nodes."""
        return self.body.n_forces

    @property
    def rest(self) -> Array:
        """(n,): the body's positions, without motion."""
        return np.concatenate([
            self.body.positions[self.body.free].ravel(), np.zeros(self.size // 2)
        ])  # fmt: skip

    def scales(self, states: Array) -> Array:
        """(n,): RMS excursion [m] and RMS speed [m/s] over the nodes, from states (S, n)."""
        half = self.size // 2
        excursion = float(np.sqrt(states[:, :half].var(axis=0).mean()))
        speed = float(np.sqrt((states[:, half:] ** 2).mean()))
        return np.repeat([excursion, speed], half)

    def vector(self, state: State) -> Array:
        """(n,): positions [m], then velocities [m/s], of the free nodes."""
        free = self.body.free
        return np.concatenate([state.positions[free], state.velocities[free]], axis=None)

    def nodes(self, states: Array) -> tuple[Array, Array]:
        """Positions and velocities (..., N, 2) [m], [m/s] of states (..., n)."""
        lead = states.shape[:-1]
        moving = states.reshape(*lead, 2, -1, 2)
        positions = np.broadcast_to(self.body.positions, (*lead, self.body.n_nodes, 2)).copy()
        velocities = np.zeros_like(positions)
        positions[..., self.body.free, :] = moving[..., 0, :, :]
        velocities[..., self.body.free, :] = moving[..., 1, :, :]
        return positions, velocities

    def outputs(self, states: Array) -> Array:
        """y = W_out^T l + b, (..., n_outputs), of states (..., n)."""
        lengths = spring_lengths(self.nodes(states)[0], self.body.springs)
        return self.readout.outputs(lengths)

    def run(
        self,
        states: Array,
        steps: int | None = None,
        *,
        offset: object = None,
        forces: object = None,
        gate: object = None,
    ) -> LoopRun:
        """Advance copies (B, n) by T steps; offset, forces and gate as for Ensemble.rollout.

        Copies that blow up are reported in `alive`, not raised.

        Raises:
            InvalidArgumentError: an argument out of bounds.
        """
        start = as_array("states", states, (None, self.size))
        copies = len(start)
        drive = check_drive(
            self.body, steps=steps, offset=offset, gate=gate, forces=forces,
            closed=self.w_out is not None, copies=copies,
        )  # fmt: skip
        population = self._population(start)
        record, done = population.run(drive, 0, drive.steps, lengths=False)
        return LoopRun(self._vectors(population), record.outputs, done == drive.steps)

    def trail(self, state: Array, stride: int, samples: int) -> Array:
        """States (samples, n) every `stride` steps of the undisturbed run from a state (n,)."""
        population = self._population(np.asarray(state)[None])
        closed = self.w_out is not None
        drive = check_drive(self.body, steps=max(1, stride), closed=closed)
        states = [np.asarray(state)[None]]
        for _ in range(samples - 1):
            population.run(drive, 0, drive.steps, lengths=False)
            states.append(self._vectors(population))
        return np.concatenate(states)

    def refined(self, factor: int) -> "ClosedLoop":
        """The same loop with steps that much smaller."""
        return replace(self, timestep=self.timestep / factor)

    def _population(self, states: Array) -> Population:
        copies = len(states)
        pairs = zip(*self.nodes(states), strict=True)
        population = Population(
            [self.body] * copies, [self.w_out] * copies, method=METHOD, timestep=self.timestep,
            threads=self.threads, packed=copies > 1,
        )  # fmt: skip
        population.set_states([State(p, v) for p, v in pairs])
        return population

    def _vectors(self, population: Population) -> Array:
        now, free = population.kernel_state, self.body.free
        moving = np.stack([now.positions[:, free], now.velocities[:, free]], axis=1)
        return moving.reshape(len(moving), -1)


def require_planar(loop: object, what: str) -> None:
    """Raise unless a loop is that of a planar body.

    Args:
        what: only these can do.

    Raises:
        InvalidArgumentError: it is another kind of loop.
    """
    if not isinstance(loop, ClosedLoop):
        wanted = f"a ClosedLoop: planar bodies only {what}"
        raise InvalidArgumentError("loop", wanted, type(loop).__name__)
