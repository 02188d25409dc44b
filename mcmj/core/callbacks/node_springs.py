"""Forces of springs between nodes, of models without tendons (callbacks.spring_table).

    d = p_b - p_a,  l = |d|,  x1 = l - l0,  x2 = (v_b - v_a) . d / l
    pull = k1 x1 + k3 x1^3 + d1 x2 + d3 x2^3, or a law of (x1, x2, k1, k3, d1, d3), or one of all
    force on a:  pull d / l,  on b:  - pull d / l

(Hauser et al. 2012, Eqs. 3, 6, 7). Two nodes at the same place pull along x, as MuJoCo's tendons.
"""

import numpy as np
from numba import int64, njit

from mcmj.core.callbacks.law_table import law_address
from mcmj.core.callbacks.leapfrog import COMPILE, extrapolated
from mcmj.core.callbacks.pointers import call_coupled, call_pull, doubles
from mcmj.core.callbacks.spring_table import (
    CUT,
    D1,
    D3,
    K1,
    K3,
    NODE_A,
    NODE_B,
    REST,
    columns,
    lengths_of,
    node_values,
    spans,
)

_SMALLEST = 1e-15  # [m], mjMINVAL
_PARAMETERS = 7  # of a coupled law's row, as tendons' user data: tag, key, l0, k1, k3, d1, d3


@njit(**COMPILE)
def add_node_springs(model, data, at, table, leapfrog):
    """qfrc_passive += forces of the table's springs."""
    law = int64(0)
    if table.key != 0.0:
        law = law_address(table.key, table.springs if table.coupled else 0)
        if law == 0:
            return
    n, n_nodes = table.springs, table.n_nodes
    # one array: making one takes as long as ten springs
    work = np.empty(6 * n_nodes + 9 * n + (model[at.nv] if leapfrog else 0))
    start = int64(work.ctypes.data)
    places, speeds = doubles(start), doubles(start + 24 * n_nodes)
    start += 48 * n_nodes
    along, rates, pull = doubles(start), doubles(start + 24 * n), doubles(start + 64 * n)
    x1, x2 = start + 48 * n, start + 56 * n
    node_values(table, doubles(data[at.qpos]), True, places)
    velocity = doubles(data[at.qvel])
    if leapfrog:
        velocity = doubles(start + 72 * n)
        extrapolated(data, at, model[at.nv], velocity)
    node_values(table, velocity, False, speeds)
    spans(table, places, along)
    spans(table, speeds, rates)
    elongations(table, along, rates, doubles(x1), doubles(x2))
    if law == 0:
        polynomial_pulls(table, doubles(x1), doubles(x2), pull)
    elif table.coupled:
        coupled_pulls(table, law, x1, x2, start + 64 * n)
    else:
        law_pulls(table, law, doubles(x1), doubles(x2), pull)
    add_pulls(table, along, pull, places, doubles(data[at.qfrc_passive]))
    work[0] = 0.0  # it lives until here


@njit(**COMPILE)
def elongations(table, along, rates, x1, x2):
    """x1, x2 (L,) from the differences of places and velocities (3, L); `along` becomes d / l."""
    n, rest = table.springs, columns(table, REST)
    lengths_of(table, along, x1)
    for j in range(n):
        apart = x1[j] >= _SMALLEST or np.isnan(x1[j])
        inverse = 1.0 / (x1[j] if apart else 1.0)
        dx, dy, dz = along[j] * inverse, along[n + j] * inverse, along[2 * n + j] * inverse
        dx = dx if apart else 1.0
        along[j], along[n + j], along[2 * n + j] = dx, dy, dz
        x2[j] = dx * rates[j] + dy * rates[n + j] + dz * rates[2 * n + j]
        x1[j] -= rest[j]


@njit(**COMPILE)
def polynomial_pulls(table, x1, x2, pull):
    """p(x1) + q(x2) of every spring."""
    k1, k3, d1, d3 = (
        columns(table, K1),
        columns(table, K3),
        columns(table, D1),
        columns(table, D3),
    )
    for j in range(table.springs):
        p, q = k1[j] + k3[j] * x1[j] * x1[j], d1[j] + d3[j] * x2[j] * x2[j]
        pull[j] = x1[j] * p + x2[j] * q


@njit(**COMPILE)
def law_pulls(table, law, x1, x2, pull):
    """The law of one spring, for every spring."""
    k1, k3, d1, d3 = (
        columns(table, K1),
        columns(table, K3),
        columns(table, D1),
        columns(table, D3),
    )
    for j in range(table.springs):
        pull[j] = call_pull(law, x1[j], x2[j], k1[j], k3[j], d1[j], d3[j])


@njit(**COMPILE)
def coupled_pulls(table, law, x1, x2, pull):
    """The law of all springs, which finds their parameters in rows as tendons' user data."""
    rows = np.zeros((table.springs, _PARAMETERS))
    for which in range(REST, CUT):
        column = columns(table, which)
        for j in range(table.springs):
            rows[j, which] = column[j]
    address = int64(rows.ctypes.data)
    call_coupled(law, x1, x2, address, table.springs, _PARAMETERS, pull)
    rows[0, 0] = 0.0  # it lives until here


@njit(**COMPILE)
def add_pulls(table, along, pull, forces, passive):
    """Pulls along the springs to the generalised forces; `forces` (3, N) is overwritten."""
    n, count, cut = table.n_nodes, table.springs, columns(table, CUT)
    a, b, first = columns(table, NODE_A), columns(table, NODE_B), doubles(table.nodes)
    for i in range(3 * n):
        forces[i] = 0.0
    for j in range(count):
        one, other, size = int64(a[j]), int64(b[j]), pull[j] if cut[j] != 0.0 else 0.0
        fx, fy = size * along[j], size * along[count + j]
        forces[one] += fx
        forces[other] -= fx
        forces[n + one] += fy
        forces[n + other] -= fy
    if table.dimensions == 3:
        for j in range(count):
            fz = (pull[j] if cut[j] != 0.0 else 0.0) * along[2 * count + j]
            forces[2 * n + int64(a[j])] += fz
            forces[2 * n + int64(b[j])] -= fz
    for i in range(n):
        if first[i] >= 0.0:
            dof = int64(first[i])
            passive[dof] += forces[i]
            passive[dof + 1] += forces[n + i]
            if table.dimensions == 3:
                passive[dof + 2] += forces[2 * n + i]
