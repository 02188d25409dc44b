"""Cyclic coordinates: positions and headings that nothing depends on.

A swimmer in open water moves alike wherever it is and wherever it heads. Shifts along such
coordinates have multipliers of magnitude 1 that say nothing about its rhythm, and its state
comes back only without them.
"""

import numpy as np

from mcmj.analysis.loops.placed_copies import PlacedCopies
from mcmj.simulation.reservoir import CHUNK
from mcmj.utils.errors import McmjError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

SHIFT = 0.1  # m, rad
SHARE = 0.1  # of the RMS speed: random velocities of the trial, for at rest nothing matters
SPEED = 0.1  # m/s, rad/s: the same of what rests
DURATION = 2.0  # s, of the trial
SAME = 1e-6  # differences over the largest value: above rounding, below any effect


def cyclic_coordinates(copies: PlacedCopies, w_out: Array | None) -> tuple[int, ...]:
    """Degrees of freedom whose position changes no signal, velocity or activation.

    Tried from where the reservoir is, with random velocities added, over DURATION: a wall that
    is not reached in that time is not noticed. A pyramidal friction cone depends on the heading.

    Raises:
        McmjError: the reservoir blew up in the trial.
    """
    chart = copies.chart
    start = _stirred(copies)
    z = np.tile(start, (chart.nv + 1, 1))
    z[1:, : chart.nv] += SHIFT * np.eye(chart.nv)
    placed = copies.at(z, w_out)
    steps = max(1, round(DURATION / placed.timestep))
    same = np.ones(chart.nv, np.bool_)
    chunk = max(1, CHUNK // len(z))
    for part in placed.stream(steps, record=("signals",), chunk=chunk):
        same &= _same(part.get("signals"))
    ends = copies.coordinates(placed)[:, None, chart.nv :]
    same &= _same(ends) & placed.alive[1:]
    if not placed.alive[0]:
        raise McmjError(
            "cyclic coordinates were not found: the reservoir blew up when it was stirred; say "
            "which they are (left_out), () for none"
        )
    return tuple(int(dof) for dof in np.flatnonzero(same))


def _stirred(copies: PlacedCopies) -> Array:
    """(n,): where the reservoir is, with random velocities added in proportion to those it has."""
    chart, start = copies.chart, copies.now
    unit = stream(0, "initial_state").standard_normal(chart.size)
    for group in chart.groups():
        speeds = group[(group >= chart.nv) & (group < 2 * chart.nv)]
        if speeds.size:
            size = float(np.sqrt((start[speeds] ** 2).mean()))
            start[speeds] += (SHARE * size or SPEED) * unit[speeds]
    return start


def _same(values: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(B - 1,): which of values (B, T, m) are those of the first copy, column by column."""
    with np.errstate(all="ignore"):  # what blew up
        size = np.abs(values[0]).max(axis=0, initial=0.0)
        apart = np.abs(values[1:] - values[0]).max(axis=1, initial=0.0)
        found: np.ndarray[tuple[int], np.dtype[np.bool_]]
        found = (apart <= SAME * (size + SAME)).all(axis=1)
    return found
