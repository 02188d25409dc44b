"""What the analysis asks of a closed loop: a map of its state vector, for many copies at once.

    z_{k+1} = Phi(z_k, u_k)        z (n,), for copies (B, n)

Two kinds: `stability.loop.ClosedLoop`, a planar body in the compiled twin, and
`reservoir_loop.ReservoirLoop`, any reservoir in MuJoCo.
"""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from mcmj.core.readout import Readout
from mcmj.utils.errors import DivergenceError
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class LoopRun:
    """What became of B copies.

    Attributes:
        states: (B, n) after the last step.
        outputs: (B, T, n_outputs) before each step; undefined after a copy blew up.
        alive: (B,) whether a copy was finite to the end.
    """

    states: Array
    outputs: Array
    alive: npt.NDArray[np.bool_]


class LoopMap(Protocol):
    """A closed loop; states are rows (B, n) of plain numbers, and may be added and interpolated."""

    @property
    def timestep(self) -> float:
        """Control step [s]."""

    @property
    def size(self) -> int:
        """n, the dimension of the state."""

    @property
    def velocities(self) -> slice:
        """Which of the coordinates are velocities."""

    @property
    def n_forces(self) -> int:
        """Number of forces that `run` takes."""

    @property
    def rest(self) -> Array:
        """(n,): the state at the start."""

    @property
    def w_out(self) -> Array | None:
        """The readout as an array; None: open loop."""

    @property
    def readout(self) -> Readout:
        """Of the loop; of an open one, it always says 0."""

    def scales(self, states: Array) -> Array:
        """(n,): units of the coordinates, from states (S, n) spread over a cycle."""

    def outputs(self, states: Array) -> Array:
        """Outputs (B, n_outputs) of states (B, n)."""

    def run(
        self,
        states: Array,
        steps: int | None = None,
        *,
        offset: object = None,
        forces: object = None,
        gate: object = None,
    ) -> LoopRun:
        """Advance copies (B, n) by T steps; those that blow up are reported, not raised."""

    def trail(self, state: Array, stride: int, samples: int) -> Array:
        """States (samples, n) every `stride` steps of the undisturbed run from a state (n,)."""

    def refined(self, factor: int) -> Self:
        """The same loop with steps that much smaller."""


def advance(loop: LoopMap, states: Array, steps: int) -> Array:
    """States (B, n) after some undisturbed steps (0 or more).

    Raises:
        DivergenceError: a copy blew up.
    """
    if steps == 0:
        return states
    run = loop.run(states, steps)
    if not run.alive.all():
        raise DivergenceError(
            f"copy {int(np.argmin(run.alive))} of the closed loop blew up within "
            f"{steps * loop.timestep:g} s; try a smaller step, or another readout",
            time=0.0,
            steps_done=0,
        )
    return run.states
