"""State arrays <-> the flat rows that the kernels work on.

A kernel works on `width` bodies side by side (1, or 4 in a pack), of which this is number
`lane`. Node i's p_x, p_y, v_x, v_y are rows[width (4 i + 0..3) + lane], its half-step velocity
half[width (2 i + 0..1) + lane], the push on it push[gap i + lane], gap 2 alone, 4 in a pack.
"""

import math

from numba import njit

from mcmj.reference.twin.stepping import COMPILE


@njit(**COMPILE)
def load_rows(rows, positions, velocities, mobility, width, lane):
    """Rows from arrays (N, 2); a fixed node has no velocity, whatever it was given."""
    for i in range(len(positions)):
        moves = 1.0 if mobility[width * i + lane] > 0.0 else 0.0
        for axis in range(2):
            at = width * (4 * i + axis) + lane
            rows[at] = positions[i, axis]
            rows[at + 2 * width] = moves * velocities[i, axis]


@njit(**COMPILE)
def store_rows(rows, positions, velocities, width, lane):
    """Arrays (N, 2) from rows."""
    for i in range(len(positions)):
        for axis in range(2):
            at = width * (4 * i + axis) + lane
            positions[i, axis], velocities[i, axis] = rows[at], rows[at + 2 * width]


@njit(**COMPILE)
def copy(values, to):
    """Faster to compile than a slice."""
    for i in range(values.size):
        to[i] = values[i]


@njit(**COMPILE)
def load_history(history, rows, half, before, width, lane):
    """What the leapfrog remembers: V, w and the last push. Returns s of its first step.

    A history (N, 5) of NaN is a start: w = V = the rows' velocity, no push, and s = 1/2.
    """
    new, gap = math.isnan(history[0, 0]), 2 if width == 1 else 4
    for i in range(len(history)):
        for axis in range(2):
            at, w_at = width * (4 * i + 2 + axis) + lane, width * (2 * i + axis) + lane
            if not new:
                rows[at] = history[i, axis]
            half[w_at] = rows[at] if new else history[i, 2 + axis]
        before[gap * i + lane] = 0.0 if new else history[i, 4]
    return 0.5 if new else 1.0


@njit(**COMPILE)
def store_history(state, b, rows, half, pushes, mobility, step, share, width, lane):
    """Body b's history = (V, w, f_k) and velocities v = w + h/2 M^-1 (F + f_k), after a run.

    h/2 M^-1 F follows from V - w = h/2 M^-1 [s F + (f_k + f_{k-1}) / 2]; pushes are f_k and
    f_{k-1}, `share` is the last step's s.
    """
    history, velocities, (last, older) = state.history[b], state.velocities[b], pushes
    gap = 2 if width == 1 else 4
    for i in range(len(history)):
        reach = 0.5 * step * mobility[width * i + lane]
        push, before = last[gap * i + lane], older[gap * i + lane]
        history[i, 4] = push
        for axis in range(2):
            v = rows[width * (4 * i + 2 + axis) + lane]
            w = half[width * (2 * i + axis) + lane]
            history[i, axis], history[i, 2 + axis] = v, w
            by_springs = (v - w - 0.5 * reach * (push + before)) / share
            velocities[i, axis] = w + by_springs + reach * push
            push, before = 0.0, 0.0  # nothing pushes vertically


@njit(**COMPILE)
def load_pack(state, first, mobility, rows, lengths, springs, half, before, share, leapfrog):
    """The pack's bodies from the state arrays; places past the last body repeat it."""
    for body in range(4):
        b = min(first + body, len(state.positions) - 1)
        load_rows(rows, state.positions[b], state.velocities[b], mobility, 4, body)
        if leapfrog:
            share[body] = load_history(state.history[b], rows, half, before, 4, body)
        for j in range(springs):
            lengths[4 * j + body] = state.lengths[b, j]


@njit(**COMPILE)
def store_pack(state, first, present, rows, lengths, springs):
    """Back to the state arrays."""
    for body in range(present):
        b = first + body
        store_rows(rows, state.positions[b], state.velocities[b], 4, body)
        for j in range(springs):
            state.lengths[b, j] = lengths[4 * j + body]


@njit(**COMPILE)
def store_pack_history(state, first, present, rows, half, pushes, mobility, step, share):
    """store_history for the pack's bodies."""
    for body in range(present):
        b = first + body
        store_history(state, b, rows, half, pushes, mobility, step, share[body], 4, body)
