"""MuJoCo's passive force callback: springs, custom spring laws, and what the leapfrog adds.

MuJoCo holds one such callback per process, so one does all, each for the models that ask for
it, and nothing for others. A model without tendons has a table of its springs and channels
(spring_table.py, node_springs.py, readout_law.py). A tendon with user data [TAG, key of the law
(callbacks.law_table), l0, k1, k3, d1, d3] is pulled through its sparse Jacobian by

    law(l - l0, dl/dt, k1, k3, d1, d3)

With COUPLED_TAG in place of TAG the law is called once, for all springs (callbacks.coupled_laws).
Under the leapfrog dl/dt is the extrapolated one.
"""

from collections import namedtuple
from typing import Any

import numba
import numpy as np
from numba import njit, types

from mcmj.core.callbacks.law_table import law_address
from mcmj.core.callbacks.leapfrog import (
    COMPILE,
    add_dampers,
    begin_step,
    extrapolated_rate,
    finish_step,
    link_actuation,
    memory_rows,
    runs_leapfrog,
)
from mcmj.core.callbacks.node_springs import add_node_springs
from mcmj.core.callbacks.offsets import byte_offset, word_offsets
from mcmj.core.callbacks.pointers import (
    COUPLED_TAG,
    TAG,
    WORDS,
    CFunction,
    call_coupled,
    call_pull,
    doubles,
    integers,
)
from mcmj.core.callbacks.readout_law import add_channels
from mcmj.core.callbacks.spring_table import read_table

SPRING_USER_SIZE = 7

_MODEL = (
    "nq nv nu ntendon nuserdata nnumeric nnumericdata numeric_adr numeric_size numeric_data dof_M0 "
    "nuser_actuator nsensordata actuator_user actuator_biasprm nuser_tendon "
    "tendon_user tendon_damping tendon_dampingpoly ten_J_rownnz ten_J_rowadr ten_J_colind"
)
_DATA = (
    "time qpos qvel ctrl sensordata userdata ten_J ten_length ten_velocity qfrc_damper "
    "qfrc_passive qfrc_actuator qfrc_applied"
)
_named_tuple: Any = namedtuple  # mypy wants literal names
# where they are, in words; and two options, in bytes
Fields = _named_tuple("Fields", f"{_MODEL} {_DATA} timestep integrator")


def compile_passive() -> CFunction:
    """The mjcb_passive callback. Offsets are a closure variable: Numba's cache keys on them."""
    link_actuation()
    at = Fields(
        **word_offsets("mjModel", _MODEL.split()),
        **word_offsets("mjData", _DATA.split()),
        timestep=byte_offset("mjModel", "opt.timestep"),
        integrator=byte_offset("mjModel", "opt.integrator"),
    )

    def passive(model, data):
        leapfrog, table = runs_leapfrog(model, at), read_table(model, at)
        if leapfrog:
            begin_step(model, data, at)
        if model[at.nuser_tendon] >= SPRING_USER_SIZE:
            add_springs(model, data, at, leapfrog)
        if table.springs > 0:
            add_node_springs(model, data, at, table, leapfrog)
        if leapfrog:
            add_dampers(model, data, at)
            finish_step(model, data, at, table)
        else:
            add_channels(model, data, at, table, doubles(data[at.qfrc_passive]))

    return numba.cfunc(types.void(WORDS, WORDS), cache=True)(passive).ctypes


@njit(**COMPILE)
def add_coupled(model, data, at, leapfrog):
    """The same where one law says all pulls from all elongations and rates (CoupledLaw)."""
    nv, rows, n_user = model[at.nv], memory_rows(data, at), model[at.nuser_tendon]
    rownnz, rowadr = integers(model[at.ten_J_rownnz]), integers(model[at.ten_J_rowadr])
    column, jacobian = integers(model[at.ten_J_colind]), doubles(data[at.ten_J])
    length, velocity = doubles(data[at.ten_length]), doubles(data[at.ten_velocity])
    force = doubles(data[at.qfrc_passive])
    count, key = 0, 0.0
    while count < model[at.ntendon]:  # springs are the first tendons
        user = doubles(model[at.tendon_user] + 8 * n_user * count)
        if user[0] != COUPLED_TAG:
            break
        key = key if user[1] == 0.0 else user[1]
        count += 1
    law = law_address(key, count)
    if law == 0:
        return
    scratch = np.empty((3, count))
    for tendon in range(count):
        first = rowadr[tendon]
        user = doubles(model[at.tendon_user] + 8 * n_user * tendon)
        scratch[0, tendon] = length[tendon] - user[2]
        scratch[1, tendon] = velocity[tendon]
        if leapfrog:
            last = first + rownnz[tendon]
            scratch[1, tendon] = extrapolated_rate(rows, nv, jacobian, column, first, last)
    start = numba.int64(scratch.ctypes.data)
    x1, x2, pull = start, start + 8 * count, start + 16 * count
    call_coupled(law, x1, x2, model[at.tendon_user], count, n_user, pull)
    for tendon in range(count):
        if doubles(model[at.tendon_user] + 8 * n_user * tendon)[1] == 0.0:
            continue  # cut
        for e in range(rowadr[tendon], rowadr[tendon] + rownnz[tendon]):
            force[column[e]] -= jacobian[e] * scratch[2, tendon]


@njit(**COMPILE)
def add_springs(model, data, at, leapfrog):
    """qfrc_passive -= J^T pull for every tendon with a law."""
    nv, rows, n_user = model[at.nv], memory_rows(data, at), model[at.nuser_tendon]
    rownnz, rowadr = integers(model[at.ten_J_rownnz]), integers(model[at.ten_J_rowadr])
    column, jacobian = integers(model[at.ten_J_colind]), doubles(data[at.ten_J])
    length, velocity = doubles(data[at.ten_length]), doubles(data[at.ten_velocity])
    force = doubles(data[at.qfrc_passive])
    for tendon in range(model[at.ntendon]):
        user = doubles(model[at.tendon_user] + 8 * n_user * tendon)
        if user[0] == COUPLED_TAG:
            add_coupled(model, data, at, leapfrog)
            return
        if user[0] != TAG:
            continue
        law = law_address(user[1], 0)
        if law == 0:
            continue
        first = rowadr[tendon]
        last = first + rownnz[tendon]
        rate = velocity[tendon]
        if leapfrog:
            rate = extrapolated_rate(rows, nv, jacobian, column, first, last)
        pull = call_pull(law, length[tendon] - user[2], rate, user[3], user[4], user[5], user[6])
        for e in range(first, last):
            force[column[e]] -= jacobian[e] * pull
