"""Any reservoir in closed loop as a map of its state vector, for many copies at once, in MuJoCo.

    z_{k+1} = Phi(z_k, u_k),   z = positions, velocities, activations as `chart.Chart` has them

Phi is one step of MuJoCo with the reservoir's own law in it, on threads, in C. Every run starts
at time 0 with cold constraint solvers, so that it depends on z alone.
"""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from mcmj.analysis.loops.loop_map import LoopRun
from mcmj.analysis.loops.placed_copies import PlacedCopies
from mcmj.analysis.loops.symmetries import cyclic_coordinates
from mcmj.core.readout import Readout
from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array, as_array


class ReservoirLoop:
    """A reservoir under its readout.

    Args:
        reservoir: without copies; what it is now stays the loop's, but for cuts and masses. Its
            positions now are what coordinates are counted from: best a place on the rhythm.
            Rotations of ball and free joints must stay within half a turn of it.
        left_out: degrees of freedom, by `names`, whose position is no coordinate, because nothing
            depends on it: every run starts them at the reference. None: those that
            `symmetries.cyclic_coordinates` finds.
        threads: results do not depend on them.

    Raises:
        InvalidArgumentError: delayed feedback, late sensors, the leapfrog or substeps, which make
            the state more than positions, velocities and activations.
        McmjError: it blew up where `left_out` was to be found.
        UnknownNameError: no such degree of freedom.
    """

    def __init__(
        self, reservoir: Reservoir, *, left_out: Sequence[str] | None = None, threads: int = 1
    ) -> None:
        self._copies = PlacedCopies(reservoir, threads)
        self.w_out = None if reservoir.w_out is None else reservoir.w_out.copy()
        self.readout: Readout = reservoir.readout
        self.timestep, self.n_forces = reservoir.timestep, reservoir.n_forces
        chart = self._copies.chart
        for name in left_out or ():
            if name not in chart.names:
                raise UnknownNameError("degree of freedom", name, chart.names)
        dofs = (
            cyclic_coordinates(self._copies, self.w_out)
            if left_out is None
            else [chart.names.index(name) for name in left_out]
        )
        self._kept = np.setdiff1d(np.arange(chart.size), dofs)
        self.left_out = tuple(chart.names[dof] for dof in sorted(dofs))

    @property
    def names(self) -> tuple[str, ...]:
        """Of all degrees of freedom; those of a free joint: x, y, z, swing_x, swing_y, yaw."""
        return self._copies.chart.names

    @property
    def size(self) -> int:
        """n, the dimension of the state: 2 nv + na without what is left out."""
        return len(self._kept)

    @property
    def velocities(self) -> slice:
        """Which of the coordinates are velocities."""
        first = self._copies.chart.nv - len(self.left_out)
        return slice(first, first + self._copies.chart.nv)

    @property
    def now(self) -> Array:
        """(n,): the state that the reservoir is in."""
        found: Array = self._copies.now[self._kept]
        return found

    @property
    def rest(self) -> Array:
        """(n,): the model's own start."""
        copies = self._placed(np.zeros((1, self.size)))
        copies.reset()
        found: Array = self._vectors(copies)[0]
        return found

    def scales(self, states: Array) -> Array:
        """(n,): RMS excursion or speed from states (S, n), one for all coordinates of a unit.

        Of [m], [rad], their rates, and activations; 1 for a unit in which nothing moves.
        """
        chart = self._copies.chart
        whole, square = np.ones(chart.size), np.zeros(chart.size)
        square[self._kept] = states.var(axis=0)
        moving = np.zeros(chart.size, np.bool_)
        moving[self._kept[self.velocities]] = True
        square[moving] += (states.mean(axis=0) ** 2)[self.velocities]
        for group in chart.groups():
            some = np.intersect1d(group, self._kept)
            if some.size and square[some].any():
                whole[some] = np.sqrt(square[some].mean())
        return whole[self._kept]

    def outputs(self, states: Array) -> Array:
        """Outputs (B, n_outputs) of states (B, n)."""
        return self.readout.outputs(self._placed(states).signals)

    def run(
        self,
        states: Array,
        steps: int | None = None,
        *,
        offset: object = None,
        forces: object = None,
        gate: object = None,
    ) -> LoopRun:
        """Advance copies (B, n) by T steps; offset, forces and gate as for Reservoir.rollout.

        Copies that blow up are reported in `alive`, not raised.

        Raises:
            InvalidArgumentError: an argument out of bounds.
        """
        copies = self._placed(states)
        drive: dict[str, Any] = {"offset": offset, "forces": forces, "gate": gate}
        chunk = max(1, CHUNK // len(states))
        parts = [
            part.get("outputs")
            for part in copies.stream(steps, **drive, record=("outputs",), chunk=chunk)
        ]
        return LoopRun(self._vectors(copies), np.concatenate(parts, axis=1), copies.alive)

    def trail(self, state: Array, stride: int, samples: int) -> Array:
        """States (samples, n) every `stride` steps of the undisturbed run from a state (n,)."""
        copies = self._placed(np.asarray(state)[None])
        states = [np.asarray(state)[None]]
        for _ in range(samples - 1):
            copies.rollout(max(1, stride), record=())
            states.append(self._vectors(copies))
        return np.concatenate(states)

    def refined(self, factor: int) -> Self:
        """The same loop with smaller steps: itself, for a factor of 1.

        Raises:
            InvalidArgumentError: another factor.
        """
        if factor != 1:
            raise InvalidArgumentError("refine", "1: a reservoir keeps its model's step", factor)
        return self

    def _placed(self, states: Array) -> Reservoir:
        given = as_array("states", states, (None, self.size))
        z = np.zeros((len(given), self._copies.chart.size))
        z[:, self._kept] = given
        return self._copies.at(z, self.w_out)

    def _vectors(self, copies: Reservoir) -> Array:
        found: Array = self._copies.coordinates(copies)[:, self._kept]
        return found
