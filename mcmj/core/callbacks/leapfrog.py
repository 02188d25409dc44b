"""The leapfrog: second order at one force evaluation a step, on top of MuJoCo's Euler.

Euler's step w' = w + h M^-1 (F + f), q' = q + h w' is kept: F are the forces of springs and
dampers, f those held over the step (actuators, qfrc_applied). But qvel is read as w, the
velocity half a step back, so that the forces have to be others:

    w_{k+1} = w_k + h M^-1 [s F(q_k, V_k) + (f_k + f_{k-1}) / 2],    s = 1
    q_{k+1} = q_k + h w_{k+1}
    V_k     = (3 w_k - w_{k-1}) / 2 = (3 q_k - 4 q_{k-1} + q_{k-2}) / 2h
    start:    w_0 = w_{-1} = v_0,  f_{-1} = 0,  s = 1/2
    v(t_{k+1}) ~ w_{k+1} + h/2 A_k,   A_k = M^-1 [F(q_k, V_k) + f_k]     what a State shows

It is Stoermer-Verlet (Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.4) with
the dampers at a backward difference of order 2. A force held from t_k to t_{k+1} acts half
before and half after the time of w_{k+1}: hence the mean of two.

The passive force callback (passive.py) adds the difference to qfrc_passive. What it has to
remember is in mjData.userdata, a part of the full state that mj_resetData sets to zero:

    [steps since the start, their time, w_k, f_k, A_k, w_{k-1}, f_{k-1}]

Evaluating twice at one time changes nothing; a jump in time starts the scheme anew. Only
models with the numeric TAG, that userdata and integrator Euler are touched: point masses on
slide joints and tendons. Forces in xfrc_applied are not averaged, and act h/2 early.
"""

from typing import Any

import numpy as np
from llvmlite import binding
from numba import njit, types

from mcmj.core.callbacks.offsets import function_address
from mcmj.core.callbacks.pointers import TAG, WORDS, address_of, doubles, integers
from mcmj.core.callbacks.readout_law import add_channels
from mcmj.utils.validation import Array

_HEAD = 2  # of userdata, before its five rows
_LAST = 3  # rows from w_k, f_k to w_{k-1}, f_{k-1}

COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}}
_find_actuator_forces = types.ExternalFunction("mj_fwdActuation", types.void(WORDS, WORDS))


def userdata_size(nv: int) -> int:
    """Size of userdata for nv degrees of freedom."""
    return _HEAD + 5 * nv


def node_velocities(qvel: Array, userdata: Array, timestep: float) -> Array:
    """v(t_k) ~ w_k + h/2 A_{k-1} after a step, from arrays (..., nv) and (..., nuserdata).

    Without leapfrog there is no userdata, and qvel is the velocity.
    """
    nv = qvel.shape[-1]
    if userdata.shape[-1] == 0:
        return qvel
    first = _HEAD + 2 * nv
    return qvel + timestep / 2 * userdata[..., first : first + nv]


def link_actuation() -> None:
    """Let compiled code, cached code too, find MuJoCo's mj_fwdActuation.

    Raises:
        McmjError: MuJoCo's library is not where its wheels have it.
    """
    binding.add_symbol("mj_fwdActuation", function_address("mj_fwdActuation"))


@njit(**COMPILE)
def memory_rows(data, at):
    """The rows w_k, f_k, A_k, w_{k-1}, f_{k-1} (nv each), one after another."""
    return doubles(data[at.userdata] + 8 * _HEAD)


@njit(**COMPILE)
def runs_leapfrog(model, at):
    """Whether this model is to be integrated so."""
    if model[at.nuserdata] < _HEAD + 5 * model[at.nv]:
        return False
    if integers(address_of(model) + at.integrator)[0] != 0:  # mjINT_EULER
        return False
    first, data = integers(model[at.numeric_adr]), doubles(model[at.numeric_data])
    found = False
    for i in range(model[at.nnumeric]):
        if first[i] < model[at.nnumericdata]:
            found |= data[first[i]] == TAG
    return found


@njit(**COMPILE)
def count_step(head, now, step):
    """Whether the time is not that of the last call; head: [steps since the start, their time].

    A step is counted where one ended; a jump in time starts anew, with step 1.
    """
    if head[0] != 0.0 and now == head[1]:
        return False
    on_time = abs(now - head[1] - step) <= 1e-6 * step
    head[0] = head[0] + 1.0 if head[0] > 0.0 and on_time else 1.0
    head[1] = now
    return True


@njit(**COMPILE)
def begin_step(model, data, at):
    """Bring the memory to the present time, but for f_k and A_k, and take native dampers out."""
    nv, step = model[at.nv], doubles(address_of(model) + at.timestep)[0]
    now = doubles(address_of(data) + 8 * at.time)[0]
    velocity, head = doubles(data[at.qvel]), doubles(data[at.userdata])
    rows = memory_rows(data, at)
    if count_step(head, now, step):
        for i in range(2 * nv):
            rows[_LAST * nv + i] = rows[i]
    passive, damper = doubles(data[at.qfrc_passive]), doubles(data[at.qfrc_damper])
    for i in range(nv):
        rows[i] = velocity[i]
        if head[0] == 1.0:
            rows[_LAST * nv + i] = velocity[i]
            rows[(_LAST + 1) * nv + i] = 0.0
        passive[i] -= damper[i]


@njit(**COMPILE)
def extrapolated_rate(rows, nv, jacobian, column, first, last):
    """dl/dt = J V_k of the tendon with elements first .. last - 1 in the Jacobian."""
    rate = 0.0
    for e in range(first, last):
        i = column[e]
        rate += jacobian[e] * (rows[i] + 0.5 * (rows[i] - rows[_LAST * nv + i]))
    return rate


@njit(**COMPILE)
def extrapolated(data, at, nv, out):
    """V_k (nv,), the velocities that dampers act on."""
    rows = memory_rows(data, at)
    for i in range(nv):
        out[i] = rows[i] + 0.5 * (rows[i] - rows[_LAST * nv + i])


@njit(**COMPILE)
def add_dampers(model, data, at):
    """qfrc_passive -= J^T q(J V_k), q MuJoCo's polynomial d0 x + d1 |x| x + d2 x^3."""
    nv, rows = model[at.nv], memory_rows(data, at)
    linear, higher = doubles(model[at.tendon_damping]), doubles(model[at.tendon_dampingpoly])
    rownnz, rowadr = integers(model[at.ten_J_rownnz]), integers(model[at.ten_J_rowadr])
    column, jacobian = integers(model[at.ten_J_colind]), doubles(data[at.ten_J])
    passive = doubles(data[at.qfrc_passive])
    for tendon in range(model[at.ntendon]):
        d0, d1, d2 = linear[tendon], higher[2 * tendon], higher[2 * tendon + 1]
        if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
            continue
        first = rowadr[tendon]
        last = first + rownnz[tendon]
        rate = extrapolated_rate(rows, nv, jacobian, column, first, last)
        size = abs(rate)
        pull = rate * (d0 + size * (d1 + size * d2))
        for e in range(first, last):
            passive[column[e]] -= jacobian[e] * pull


@njit(**COMPILE)
def finish_step(model, data, at, table):
    """qfrc_passive = F(q_k, V_k) -> s F + (f_k + f_{k-1}) / 2, less what MuJoCo adds of f_k itself.

    Channels of a spring table are passive forces to MuJoCo.
    """
    nv, start = model[at.nv], doubles(data[at.userdata])[0] == 1.0
    pushes = np.zeros(nv)
    if table.springs > 0:
        add_channels(model, data, at, table, pushes)
    else:
        _find_actuator_forces(model, data)  # MuJoCo's next stage, which will find the same
    rows, mass = memory_rows(data, at), doubles(model[at.dof_M0])
    passive, actuator = doubles(data[at.qfrc_passive]), doubles(data[at.qfrc_actuator])
    applied = doubles(data[at.qfrc_applied])
    share = 0.5 if start else 1.0
    for i in range(nv):
        held = actuator[i] + applied[i] + pushes[i]
        rows[nv + i] = held
        rows[2 * nv + i] = (passive[i] + held) / mass[i]
        mean = 0.5 * (rows[(_LAST + 1) * nv + i] - held)
        passive[i] = share * passive[i] + mean + pushes[i]
