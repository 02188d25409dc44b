"""State arrays <-> the flat rows that the kernels work on.

A kernel works on `width` bodies side by side (1, or 4 in a pack), of which this is number
`lane`. Node i's p_x, p_y, v_x, v_y are rows[width (4 i + 0..3) + lane], its half-step velocity
half[width (2 i + 0..1) + lane], the push on it push[gap i + lane], gap 2 alone, 4 in a pack.
"""

import math

from numba import njit

from mcmj.reference.twin.stepping import COMPILE


@njit(**COMPILE)
def load_body(run, work, mobility, b, lane):
    """Body b from the state arrays; a fixed node has no velocity, whatever it was given."""
    width, positions, velocities = work.share.size, run.state.positions[b], run.state.velocities[b]
    for i in range(work.rows.size // (4 * width)):
        moves = 1.0 if mobility[width * i + lane] > 0.0 else 0.0
        for axis in range(2):
            at = width * (4 * i + axis) + lane
            work.rows[at] = positions[i, axis]
            work.rows[at + 2 * width] = moves * velocities[i, axis]
    if run.scheme.leapfrog:
        load_history(run.state.history[b], work, lane)


@njit(**COMPILE)
def store_body(run, work, mobility, b, lane):
    """Body b back to the state arrays."""
    width, positions, velocities = work.share.size, run.state.positions[b], run.state.velocities[b]
    for i in range(work.rows.size // (4 * width)):
        for axis in range(2):
            at = width * (4 * i + axis) + lane
            positions[i, axis], velocities[i, axis] = work.rows[at], work.rows[at + 2 * width]
    if run.scheme.leapfrog and run.steps > 0:
        store_history(run, work, mobility, b, lane)


@njit(**COMPILE)
def load_history(history, work, lane):
    """What the leapfrog remembers: V, w and the last push; and s of its first step.

    A history (N, 5) of NaN is a start: w = V = the rows' velocity, no push, and s = 1/2.
    """
    width = work.share.size
    new, gap = math.isnan(history[0, 0]), 2 if width == 1 else 4
    for i in range(work.rows.size // (4 * width)):
        for axis in range(2):
            at, w_at = width * (4 * i + 2 + axis) + lane, width * (2 * i + axis) + lane
            if not new:
                work.rows[at] = history[i, axis]
            work.half[w_at] = work.rows[at] if new else history[i, 2 + axis]
        work.before[gap * i + lane] = 0.0 if new else history[i, 4]
    work.share[lane] = 0.5 if new else 1.0


@njit(**COMPILE)
def store_history(run, work, mobility, b, lane):
    """Body b's history = (V, w, f_k) and velocities v = w + h/2 M^-1 (F + f_k), after a run.

    h/2 M^-1 F follows from V - w = h/2 M^-1 [s F + (f_k + f_{k-1}) / 2]; f_k and f_{k-1} are
    work.before and work.older, s is the last step's.
    """
    history, velocities, width = run.state.history[b], run.state.velocities[b], work.share.size
    gap = 2 if width == 1 else 4
    for i in range(work.rows.size // (4 * width)):
        reach = 0.5 * run.scheme.step * mobility[width * i + lane]
        push, before = work.before[gap * i + lane], work.older[gap * i + lane]
        history[i, 4] = push
        for axis in range(2):
            v = work.rows[width * (4 * i + 2 + axis) + lane]
            w = work.half[width * (2 * i + axis) + lane]
            history[i, axis], history[i, 2 + axis] = v, w
            by_springs = (v - w - 0.5 * reach * (push + before)) / work.share[lane]
            velocities[i, axis] = w + by_springs + reach * push
            push, before = 0.0, 0.0  # nothing pushes vertically


@njit(**COMPILE)
def load_pack(run, work, mobility, first):
    """The pack's bodies from the state arrays; places past the last body repeat it."""
    for lane in range(4):
        b = min(first + lane, run.done.size - 1)
        load_body(run, work, mobility, b, lane)
        for j in range(work.lengths.size // 4):
            work.lengths[4 * j + lane] = run.state.lengths[b, j]


@njit(**COMPILE)
def store_pack(run, work, mobility, first):
    """Back to the state arrays."""
    for lane in range(min(4, run.done.size - first)):
        b = first + lane
        store_body(run, work, mobility, b, lane)
        for j in range(work.lengths.size // 4):
            run.state.lengths[b, j] = work.lengths[4 * j + lane]
