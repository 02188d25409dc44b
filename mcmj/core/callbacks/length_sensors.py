"""MuJoCo's sensor callback: lengths of springs, of models without tendons.

A model with a spring table (callbacks.spring_table) has L sensors of the lengths l [m], the last
of sensordata, computed at the stage of positions: not in the inner stages of RK4. With a memory
of n slots there are L more before them, which the readout hears: the lengths k - (n - 1) control
steps ago, 0 before the first, held over the control step of `period` physics steps. The memory
stands in user data, a part of the full state that mj_resetData sets to zero, as its last numbers:

    [physics steps since the start + 1, their time, slot 0 (L), slot 1 (L), ..]

Evaluating twice at one time changes nothing; a jump in time starts anew, with nothing to show.
"""

from typing import NamedTuple

import numba
import numpy as np
from numba import int64, njit, types

from mcmj.core.callbacks.leapfrog import COMPILE, count_step
from mcmj.core.callbacks.offsets import byte_offset, word_offsets
from mcmj.core.callbacks.pointers import WORDS, CFunction, address_of, doubles
from mcmj.core.callbacks.spring_table import (
    MEMORY_HEAD,
    lengths_of,
    memory_size,
    node_values,
    read_table,
    spans,
)

POSITION_STAGE = 1  # mjSTAGE_POS
MOST_STEPS = 2.0**53


class Offsets(NamedTuple):
    """Where the fields are in mjModel and mjData, in words; `time` and `timestep` in bytes."""

    nq: int
    nv: int
    nu: int
    nnumeric: int
    nnumericdata: int
    numeric_adr: int
    numeric_size: int
    numeric_data: int
    nsensordata: int
    nuserdata: int
    qpos: int
    sensordata: int
    userdata: int
    time: int
    timestep: int


def compile_sensors() -> CFunction:
    """The mjcb_sensor callback. Offsets are a closure variable: Numba's cache keys on them."""
    model_fields, data_fields = Offsets._fields[:10], Offsets._fields[10:13]
    words = word_offsets("mjModel", model_fields) | word_offsets("mjData", data_fields)
    at = Offsets(
        **words,
        time=byte_offset("mjData", "time"),
        timestep=byte_offset("mjModel", "opt.timestep"),
    )

    def sensors(model, data, stage):
        if stage != POSITION_STAGE:
            return
        table = read_table(model, at)
        if table.springs == 0 or model[at.nsensordata] < table.springs:
            return
        lengths = model[at.nsensordata] - table.springs
        measure(data, at, table, lengths)
        if table.slots > 0:
            remember(model, data, at, table, lengths)

    return numba.cfunc(types.void(WORDS, WORDS, types.int32), cache=True)(sensors).ctypes


@njit(**COMPILE)
def measure(data, at, table, first):
    """Lengths of all springs [m] to sensordata from `first` on."""
    work = np.empty(3 * (table.n_nodes + table.springs))
    start = int64(work.ctypes.data)
    places, along = doubles(start), doubles(start + 24 * table.n_nodes)
    node_values(table, doubles(data[at.qpos]), True, places)
    spans(table, places, along)
    lengths_of(table, along, doubles(data[at.sensordata] + 8 * first))
    work[0] = 0.0  # it lives until here


@njit(**COMPILE)
def remember(model, data, at, table, first):
    """Put the lengths into their slot, and what the oldest slot holds to the first sensors."""
    n = table.springs
    start = model[at.nuserdata] - memory_size(n, table.slots)
    if start < 0 or first < n:
        return
    head = doubles(data[at.userdata] + 8 * start)
    memory = doubles(data[at.userdata] + 8 * (start + MEMORY_HEAD))
    now = doubles(address_of(data) + at.time)[0]
    step = doubles(address_of(model) + at.timestep)[0]
    count_step(head, now, step)
    if not head[0] < MOST_STEPS:
        head[0] = 1.0
    if head[0] == 1.0:
        for i in range(n * table.slots):
            memory[i] = 0.0
    done = int64(head[0]) - 1
    sample = done // table.period
    sensors = doubles(data[at.sensordata])
    now_at, then_at = n * (sample % table.slots), n * ((sample + 1) % table.slots)
    if done % table.period == 0:
        for j in range(n):
            memory[now_at + j] = sensors[first + j]
    for j in range(n):
        sensors[j] = memory[then_at + j]
