"""Showing symbols to a reservoir: each is held for a while, then the signals are read."""

from typing import Any, Literal, TypeAlias

import numpy as np

from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.utils.validation import Array, require_count

Driven: TypeAlias = Literal["inputs", "offset"]


def held_states(
    simulation: Reservoir,
    symbols: Array,
    hold: int,
    *,
    driven: Driven = "inputs",
    gate: object = None,
) -> Array:
    """Signals (..., M, n_signals), of a body lengths [m], at the start of each symbol's last step.

    Args:
        simulation: goes on from where it is. Of copies, `...` is these, else nothing.
        symbols: (..., M, n_inputs), or (..., M, n_outputs) for the offset.
        hold: control steps that each is shown for.
        driven: what they are values of, the inputs or the offset of the output channels.
        gate: as for a rollout.

    Raises:
        DivergenceError: it blew up.
        InvalidArgumentError: wrong shape, or hold < 1.
    """
    require_count("hold", hold, 1)
    drive: dict[str, Any] = {driven: np.repeat(symbols, hold, axis=-2), "gate": gate}
    at_once = CHUNK // (simulation.copies or 1)
    whole = max(1, at_once // hold) * hold  # chunks end with a symbol
    parts = [
        part.get("signals")[..., hold - 1 :: hold, :].copy()
        for part in simulation.stream(**drive, record=("signals",), chunk=whole)
    ]
    return np.concatenate(parts, axis=-2)
