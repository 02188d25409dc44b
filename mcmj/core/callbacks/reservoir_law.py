"""The law of a reservoir in any MuJoCo model, as mjcb_control: sensors drive actuators.

    y_c = sum_j w[j, c] s_j + b_c                    s_j: components of sensors
    ctrl of actuator a = sum over its drives of gain * (g_c y_c + o_c), or of gain * u_i

Offsets o_c and inputs u_i are the ctrl of actuators without force, which hold nothing else; they
carry the weights, the bias last, as user data, and the gate g_c as first bias parameter. A custom
numeric of the model says which is which (`block`). No address stands in a model, and every number
is checked against the model's own sizes before it is used.

The law is evaluated where the sensors are of this moment, that is once a step: a sensor of the
time says so. In the later stages of RK4 ctrl stays as it is.

Sensors that MuJoCo computes after actuation are heard as they were one step before. They are no
part of MuJoCo's state: a state that is restored has them as user data, 1 before them, and the law
puts them back at its next step.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
from numba import types

from mcmj.core.callbacks.offsets import byte_offset, word_offsets
from mcmj.core.callbacks.pointers import (
    WORDS,
    CFunction,
    address_of,
    doubles,
    find_numeric,
    whole,
)

RESERVOIR_TAG = 201205.0  # six digits are what MuJoCo's writer of MJCF keeps
NUMERIC = "mcmj_reservoir"
N_BIAS_PARAMETERS = 10  # mjNBIAS
_HEAD = 9
# NaN and infinity keep their meaning
COMPILE: dict[str, Any] = {"cache": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}}


class Law(NamedTuple):
    """The sizes of a law, and where its parts are.

    Attributes:
        outputs: number of outputs; the channels are these, then the inputs.
        first: actuator of the first channel; those of the others follow it.
        clock: address in sensordata of a sensor of the time.
        signals, late, drives: numbers of them, see `block`.
        memory: in userdata, where the values of the late signals begin, after a 1 if they hold.
    """

    outputs: int
    first: int
    clock: int
    signals: int
    late: int
    drives: int
    memory: int


def block(
    law: Law,
    signals: Sequence[int],
    late: Sequence[int],
    drives: Sequence[tuple[int, int, float]],
    delay: float,
) -> list[float]:
    """The custom numeric of a model.

    Args:
        signals: addresses in sensordata.
        late: those of them that MuJoCo computes after actuation.
        drives: (actuator, channel, gain), those of a channel beside each other.
        delay: of the sensors [s]; until then the outputs are 0.
    """
    head = [RESERVOIR_TAG, *law[:6], delay, law.memory]
    return [*map(float, (*head, *signals, *late)), *(float(x) for drive in drives for x in drive)]


class Offsets(NamedTuple):
    """Where the law's fields are in mjModel and mjData, in words; `time` in bytes."""

    nu: int
    nuser_actuator: int
    nsensordata: int
    nuserdata: int
    nnumeric: int
    nnumericdata: int
    numeric_adr: int
    numeric_size: int
    numeric_data: int
    actuator_user: int
    actuator_biasprm: int
    ctrl: int
    sensordata: int
    userdata: int
    time: int


def compile_control() -> CFunction:
    """The mjcb_control callback. Offsets are closure variables: Numba's cache keys on them."""
    model_fields, data_fields = Offsets._fields[:11], Offsets._fields[11:14]
    words = word_offsets("mjModel", model_fields) | word_offsets("mjData", data_fields)
    at = Offsets(**words, time=byte_offset("mjData", "time"))

    def control(model, data):
        start, size = find_numeric(model, at, RESERVOIR_TAG, _HEAD)
        if start < 0:
            return
        values = numba.carray(doubles(model[at.numeric_data] + 8 * start), size)
        law = read_law(values, model, at)
        time = doubles(address_of(data) + at.time)[0]
        if law.signals == 0 or doubles(data[at.sensordata])[law.clock] != time:
            return  # not ours; or a later stage of RK4
        put_back(values, law, data, at)
        set_controls(values, law, model, data, at, time >= values[7])

    return numba.cfunc(types.void(WORDS, WORDS), cache=True)(control).ctypes


@numba.njit(**COMPILE)
def read_law(values, model, at):
    """The block as a Law; one without signals if anything in it is out of bounds."""
    nothing = Law(0, 0, 0, 0, 0, 0, 0)
    nu, n_data = model[at.nu], model[at.nsensordata]
    signals = whole(values[4], model[at.nuser_actuator])
    law = Law(
        whole(values[1], nu + 1), whole(values[2], nu), whole(values[3], n_data), signals,
        whole(values[5], signals + 1), whole(values[6], values.size),
        whole(values[8], model[at.nuserdata] + 1),
    )  # fmt: skip
    if min(law) < 0 or law.first + law.outputs > nu:
        return nothing
    heard = law.signals + law.late
    if _HEAD + heard + 3 * law.drives != values.size:
        return nothing
    if law.late > 0 and law.memory + 1 + law.late > model[at.nuserdata]:
        return nothing
    for j in range(heard):
        if whole(values[_HEAD + j], n_data) < 0:
            return nothing
    for k in range(_HEAD + heard, values.size, 3):
        if whole(values[k], law.first) < 0 or whole(values[k + 1], nu - law.first) < 0:
            return nothing
    return law


@numba.njit(**COMPILE)
def put_back(values, law, data, at):
    """Late sensors of a state that was restored."""
    if law.late == 0:
        return
    kept, sensors = doubles(data[at.userdata] + 8 * law.memory), doubles(data[at.sensordata])
    if kept[0] == 1.0:
        for j in range(law.late):
            sensors[numba.int64(values[_HEAD + law.signals + j])] = kept[1 + j]
        kept[0] = 0.0


@numba.njit(**COMPILE)
def output(values, law, model, data, at, actuator):
    """g y of a channel, given its actuator."""
    gate = doubles(model[at.actuator_biasprm])[actuator * N_BIAS_PARAMETERS]
    if gate == 0.0:
        return 0.0
    weights = doubles(model[at.actuator_user] + 8 * model[at.nuser_actuator] * actuator)
    sensors, total = doubles(data[at.sensordata]), 0.0
    for j in range(law.signals):
        total += weights[j] * sensors[numba.int64(values[_HEAD + j])]
    return gate * (total + weights[law.signals])


@numba.njit(**COMPILE)
def set_controls(values, law, model, data, at, heard):
    """ctrl of all actuators that are driven; `heard` is false while delayed sensors are empty."""
    ctrl, begin = doubles(data[at.ctrl]), _HEAD + law.signals + law.late
    for k in range(begin, values.size, 3):
        ctrl[numba.int64(values[k])] = 0.0
    last, value = -1, 0.0
    for k in range(begin, values.size, 3):  # those of a channel are neighbours
        channel = numba.int64(values[k + 1])
        if channel != last:
            last, value = channel, ctrl[law.first + channel]
            if channel < law.outputs and heard:
                value += output(values, law, model, data, at, law.first + channel)
        ctrl[numba.int64(values[k])] += values[k + 2] * value
