"""Springs and channels of a model without tendons: a custom numeric that mcmj's callbacks read.

A block of numbers says all:

    head      TABLE_TAG, dimensions, N, L, number of channels, key of the law (0: polynomial), 1 if
              it is coupled, slots of the memory of lengths (0: none), physics steps between them
    nodes     N first degrees of freedom (-1: fixed), then positions at the start x (N), y, z [m]
    channels  for each, its share on each degree of freedom (nv); channel c is actuator c
    springs   L numbers each: node a, node b, l0, k1, k3, d1, d3, 0 if it is cut

The degrees of freedom of a free node are slides along x, y (and z), one after another. A model
may come from anywhere: every number is checked against the model's own sizes before it is used,
and a law is called by a key of this process only (callbacks.law_table).
"""

from collections import namedtuple
from typing import Any

import numpy as np
from numba import int64, njit

from mcmj.core.callbacks.pointers import doubles, find_numeric, whole

TABLE_TAG = 20120613.0  # the paper's year and last page
HEAD, NODE, SPRING = 9, 4, 8  # numbers in the head, of a node, of a spring
NODE_A, NODE_B, REST, K1, K3, D1, D3, CUT = range(SPRING)
MEMORY_HEAD = 2  # of the memory of lengths: steps since the start, their time

# `nodes`, `shares`, `rows`: addresses of the block's parts; one with `springs` 0 is none
_named_tuple: Any = namedtuple  # mypy wants literal names
Table = _named_tuple(
    "Table",
    "dimensions n_nodes springs channels key coupled slots period nodes shares rows",
)


@njit(cache=True)
def memory_size(n_springs, slots):
    """Numbers of user data, its last ones, that the memory of lengths takes."""
    return MEMORY_HEAD + slots * n_springs if slots else 0


@njit(cache=True)
def no_table():
    """A table without springs."""
    none = int64(0)
    return Table(none, none, none, none, 0.0, False, none, none, none, none, none)


@njit(cache=True)
def read_table(model, at):
    """The model's block as a Table, its indices checked; without springs if there is none."""
    start, size = find_numeric(model, at, TABLE_TAG, HEAD)
    if start < 0:
        return no_table()
    head, nv = doubles(model[at.numeric_data] + 8 * start), int64(model[at.nv])
    dimensions, n_nodes, springs = whole(head[1], 4), whole(head[2], size), whole(head[3], size)
    channels, slots = whole(head[4], model[at.nu] + 1), whole(head[7], 2**31)
    period = whole(head[8], 2**31)
    if min(dimensions - 2, n_nodes, springs, channels, slots, period - 1) < 0:
        return no_table()
    if size != HEAD + NODE * n_nodes + nv * channels + SPRING * springs:
        return no_table()
    nodes = model[at.numeric_data] + 8 * (start + HEAD)
    shares = nodes + 8 * NODE * n_nodes
    rows = shares + 8 * nv * channels
    last = min(model[at.nq], nv) - dimensions
    if not all_inside(doubles(nodes), n_nodes, -1.0, last):
        return no_table()
    if not all_inside(doubles(rows), 2 * springs, 0.0, n_nodes - 1):
        return no_table()
    return Table(
        dimensions, n_nodes, springs, channels, head[5], head[6] != 0.0, slots, period,
        nodes, shares, rows,
    )  # fmt: skip


@njit(cache=True)
def all_inside(values, count, low, high):
    """Whether low <= value <= high for all, so that none is NaN."""
    outside = 0
    for i in range(count):
        outside += not (low <= values[i] <= high)
    return outside == 0


@njit(cache=True)
def node_values(table, moved, starts, out):
    """x, y, z (3, N) of all nodes: of their degrees of freedom, plus the start's if asked."""
    n, first, start = table.n_nodes, doubles(table.nodes), doubles(table.nodes + 8 * table.n_nodes)
    for i in range(3 * n):
        out[i] = start[i] if starts else 0.0
    for i in range(n):
        if first[i] >= 0.0:
            dof = int64(first[i])
            out[i] += moved[dof]
            out[n + i] += moved[dof + 1]
            if table.dimensions == 3:
                out[2 * n + i] += moved[dof + 2]


@njit(cache=True)
def columns(table, which):
    """A pointer to one of the springs' numbers (L,), NODE_A to CUT."""
    return doubles(table.rows + 8 * which * table.springs)


@njit(cache=True)
def spans(table, places, out):
    """From node a to node b of every spring: dx (L), dy, dz of `places` (3, N)."""
    a, b, n, count = columns(table, NODE_A), columns(table, NODE_B), table.n_nodes, table.springs
    for j in range(count):
        one, other = int64(a[j]), int64(b[j])
        out[j] = places[other] - places[one]
        out[count + j] = places[n + other] - places[n + one]
    for j in range(count):
        out[2 * count + j] = 0.0
    if table.dimensions == 3:
        for j in range(count):
            out[2 * count + j] = places[2 * n + int64(b[j])] - places[2 * n + int64(a[j])]


@njit(cache=True, fastmath=False)  # else it takes its callers'
def lengths_of(table, differences, out):
    """Lengths (L,) from dx, dy, dz (3, L), rounded as NumPy's, so that what is at rest stays so."""
    n = table.springs
    for j in range(n):
        dx, dy, dz = differences[j], differences[n + j], differences[2 * n + j]
        out[j] = np.sqrt(dx * dx + dy * dy + dz * dz)
