"""The limit cycle of a closed loop: a point on it, its direction, and its period.

The period T is in general no multiple of the step h. Off the grid the state is taken from the
cubic polynomial in time through the four steps around (error h^4/24 |z''''|, about 1e-13 of
the cycle at 1 ms and periods of seconds): of perturbed copies too, so that its derivative is
that of the flow map. What is too fast to be interpolated has died away after a period.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from mcmj.analysis.loops.loop_map import LoopMap, advance
from mcmj.metrics import orbits
from mcmj.utils.errors import McmjError
from mcmj.utils.validation import Array, require_number

_NODES = np.arange(-1.0, 3.0)  # steps around the moment, relative to the one before it
TOLERANCE = 1e-7  # largest residual of a cycle
SAMPLES = 64  # of a cycle, for its size


@dataclass(frozen=True)
class Cycle:
    """A limit cycle.

    Attributes:
        state: (n,) a point on it.
        tangent: (n,) dz/dt there.
        period: T [s].
        scale: (n,) RMS excursion of positions and RMS speed over one period, one for all
            coordinates of a kind (a body's nodes): the units in which states are compared.
        residual: |z(T) - z(0)| in these units (RMS over coordinates): how settled it is.
    """

    state: Array
    tangent: Array
    period: float
    scale: Array
    residual: float


def weights_at(fraction: float) -> Array:
    """Weights (4,) of the cubic through _NODES at a fraction of a step."""
    matrix = np.vander(_NODES, increasing=True).T
    return np.linalg.solve(matrix, fraction ** np.arange(4.0))


def around(loop: LoopMap, states: Array, steps: int) -> Array:
    """States (4, B, n) after steps - 1, ..., steps + 2 steps."""
    rows = [advance(loop, states, steps - 1)]
    for _ in range(3):
        rows.append(advance(loop, rows[-1], 1))
    return np.stack(rows)


def flow_map(loop: LoopMap, states: Array, duration: float) -> Array:
    """States (B, n) after any duration [s] of at least two steps, interpolated between steps.

    Raises:
        DivergenceError: a copy blew up.
    """
    steps = int(duration / loop.timestep)
    weights = weights_at(duration / loop.timestep - steps)
    return np.tensordot(weights, around(loop, states, steps), axes=1)


def find_cycle(
    loop: LoopMap,
    start: Array,
    guess: float,
    *,
    settle: float = 100.0,
    rounds: int = 10,
    tolerance: float = TOLERANCE,
) -> Cycle:
    """The cycle that a state (n,) runs into.

    Args:
        guess: expected period [s], right within 20 %.
        settle: let transients die for so long [s] before each attempt.
        rounds: attempts.
        tolerance: largest residual of the cycle; contacts are solved to a tolerance of their own.

    Raises:
        DivergenceError: the loop blew up.
        McmjError: the loop rests, does not come back, or has not settled after all attempts.
    """
    require_number("guess", guess, 2 * loop.timestep)
    state = np.asarray(start)[None]
    for _ in range(rounds):
        state = advance(loop, state, max(1, round(settle / loop.timestep)))
        cycle = _cycle_at(loop, state, guess)
        if cycle.residual <= tolerance:
            return cycle
    raise McmjError(
        f"no settled cycle after {rounds * settle:g} s: the state misses itself by "
        f"{cycle.residual:.2g} of its excursion after a period of {cycle.period:.5g} s; let it "
        f"settle for longer than {rounds} x {settle:g} s, or allow more than {tolerance:g}"
    )


def _cycle_at(loop: LoopMap, state: Array, guess: float) -> Cycle:
    h = loop.timestep
    outputs = loop.run(state, round(6 * guess / h)).outputs[0]
    rough = orbits.period(outputs, h, guess)
    if np.isnan(rough):
        raise McmjError(f"the loop has no rhythm with a period near {guess:.4g} s")
    steps = round(rough / h) - 1
    before, here, after = (advance(loop, state, k)[0] for k in range(3))
    tangent = (after - before) / (2 * h)
    scale = loop.scales(loop.trail(state[0], max(1, steps // SAMPLES), SAMPLES))
    normal = tangent / scale**2
    rows = around(loop, here[None], steps)[:, 0]
    heights = (rows - here) @ normal / (tangent @ normal * h)  # signed, in steps

    def height(fraction: float) -> float:
        return float(weights_at(fraction) @ heights)

    if height(-1.0) * height(4.0) > 0:
        raise McmjError(f"the loop does not come back to where it was after {rough:.4g} s")
    fraction = brentq(height, -1.0, 4.0, xtol=1e-12)
    period = (steps + fraction) * h
    back = flow_map(loop, here[None], period)[0]
    residual = float(np.sqrt((((back - here) / scale) ** 2).mean()))
    return Cycle(here, tangent, period, scale, residual)
