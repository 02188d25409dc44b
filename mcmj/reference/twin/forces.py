"""Bodies as the kernels read them, and the forces of their springs.

Springs are taken four at a time; a body with L springs computes blocks = ceil(L / 4) of
them, the last filled up with springs of no stiffness.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mcmj.reference.twin.stepping import COMPILE, INLINE, load_law, spring_force, transpose
from mcmj.reference.twin.vectors import (
    lane,
    largest,
    load2,
    load4,
    splat4,
    store,
    unpack_high,
    unpack_low,
)


class Bodies(NamedTuple):
    """B bodies in kernel layout. M, K: largest spring and node count, rounded up to
    multiples of 8."""

    nodes: np.ndarray  # (B,) int64: masses of each body
    springs: np.ndarray  # (B,) int64
    ends: np.ndarray  # (B, 2 M) int32: per block of 4 springs 4 tails, 4 heads; 4 x node
    turns: np.ndarray  # (B, 3 M) int32: order of summation; 2 x (place in pulls, tail, head)
    laws: np.ndarray  # (B, 5 M): per block 4 l0 (m), 4 k1, 4 k3, 4 d1, 4 d3 (SI)
    brakes: np.ndarray  # (B, 2 M): per block 4 r d1, 4 of 3 r d3 (1/s, s/m^2), see find_pulls
    mobility: np.ndarray  # (B, K): 1 / mass, 0 for fixed nodes (1/kg)
    channels: np.ndarray  # (B, (n_in + n_out) K): w_in then w_fb, transposed
    w_out: np.ndarray  # (B, n_out M)
    bias: np.ndarray  # (B, n_out)


@njit(**COMPILE)
def body_of(bodies, b):
    """Body b: the same fields without the leading axis."""
    return Bodies(
        bodies.nodes[b],
        bodies.springs[b],
        bodies.ends[b],
        bodies.turns[b],
        bodies.laws[b],
        bodies.brakes[b],
        bodies.mobility[b],
        bodies.channels[b],
        bodies.w_out[b],
        bodies.bias[b],
    )


@njit(**INLINE)
def find_pulls(body, work, pulls, scheme):
    """Replace each spring's length; pulls = force on its tail, springs 0 2 1 3 in a block.

    Returns, if the method asks for it, a bound on the dampers' rate [1/s]: the largest
    r q'(x2) of a spring, r as in `body.damper_reach`.
    """
    ends, rows, lengths, asked = body.ends, work.rows, work.lengths, scheme.adaptive
    fastest = splat4(0.0)
    for block in range(pulls.size // 8):
        e = 8 * block
        gap = transpose(
            load4(rows, ends[e + 4]) - load4(rows, ends[e]),
            load4(rows, ends[e + 5]) - load4(rows, ends[e + 1]),
            load4(rows, ends[e + 6]) - load4(rows, ends[e + 2]),
            load4(rows, ends[e + 7]) - load4(rows, ends[e + 3]),
        )
        law, before = load_law(body.laws, 20 * block), load4(lengths, 4 * block)
        length, f_x, f_y, x2 = spring_force(gap, law, before, scheme)
        store(lengths, 4 * block, length)
        store(pulls, e, unpack_low(f_x, f_y))
        store(pulls, e + 4, unpack_high(f_x, f_y))
        if asked:
            rates = load4(body.brakes, e) + load4(body.brakes, e + 4) * x2 * x2
            fastest = largest(fastest, rates)
    low = max(lane(fastest, 0), lane(fastest, 1))
    return max(low, max(lane(fastest, 2), lane(fastest, 3)))


@njit(**INLINE)
def sum_forces(body, pulls, work):
    """Add each spring's force to its ends.

    Springs are visited so that neighbours in the list share no node: each addition would
    otherwise wait for the one before it.
    """
    turns, force = body.turns, work.force
    for turn in range(body.springs):
        tail, head = turns[3 * turn + 1], turns[3 * turn + 2]
        pull = load2(pulls, turns[3 * turn])
        on_tail, on_head = load2(force, tail) + pull, load2(force, head) - pull
        store(force, tail, on_tail)
        store(force, head, on_head)
