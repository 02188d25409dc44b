"""Showing symbols to a body: each is held for a while, then the lengths are read."""

import numpy as np

from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.utils.validation import Array, require_count


def held_states(simulation: Reservoir, symbols: Array, hold: int) -> Array:
    """Lengths (..., M, L) [m] at the start of the last step of each symbol.

    Args:
        simulation: goes on from where it is. Of an ensemble, `...` is its copies, else nothing.
        symbols: (..., M, n_inputs).
        hold: control steps that each is shown for.

    Raises:
        DivergenceError: the body blew up.
        InvalidArgumentError: wrong shape, or hold < 1.
    """
    require_count("hold", hold, 1)
    inputs = np.repeat(symbols, hold, axis=-2)
    whole = max(1, CHUNK // hold) * hold  # chunks end with a symbol
    parts = [
        part.get("lengths")[..., hold - 1 :: hold, :].copy()
        for part in simulation.stream(inputs=inputs, record=("lengths",), chunk=whole)
    ]
    return np.concatenate(parts, axis=-2)
