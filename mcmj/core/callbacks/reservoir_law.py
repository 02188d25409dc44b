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

import numba
import numpy as np
from numba import types

from mcmj.core.callbacks.offsets import byte_offset, word_offsets
from mcmj.core.callbacks.pointers import WORDS, CFunction, address_of, doubles, integers

RESERVOIR_TAG = 201205.0  # six digits are what MuJoCo's writer of MJCF keeps
NUMERIC = "mcmj_reservoir"
N_BIAS_PARAMETERS = 10  # mjNBIAS
_HEAD = 9
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # NaN and infinity keep their meaning


def block(
    signals: Sequence[int],
    late: Sequence[int],
    drives: Sequence[tuple[int, int, float]],
    *,
    outputs: int,
    first: int,
    clock: int,
    delay: float,
    memory: int,
) -> list[float]:
    """The custom numeric of a model.

    Args:
        signals: addresses in sensordata.
        late: those of them that MuJoCo computes after actuation.
        drives: (actuator, channel, gain); channels are the outputs, then the inputs.
        outputs: number of outputs.
        first: actuator of the first channel; those of the others follow it.
        clock: address of a sensor of the time.
        delay: of the sensors [s]; until then the outputs are 0.
        memory: in userdata, where the values of `late` begin, after a 1 if they hold.
    """
    sizes = len(signals), len(late), len(drives)
    head = [RESERVOIR_TAG, outputs, first, clock, *sizes, delay, memory]
    return [*map(float, (*head, *signals, *late)), *(float(x) for drive in drives for x in drive)]


def compile_control() -> CFunction:
    """The mjcb_control callback. Offsets are closure variables: Numba's cache keys on them."""
    model_at = word_offsets(
        "mjModel",
        ["nu", "nuser_actuator", "nsensordata", "nuserdata", "nnumeric", "nnumericdata",
         "numeric_adr", "numeric_size", "numeric_data", "actuator_user", "actuator_biasprm"],
    )  # fmt: skip
    data_at = word_offsets("mjData", ["ctrl", "sensordata", "userdata"])
    nu_at, n_user_at, n_data_at = (
        model_at[name] for name in ("nu", "nuser_actuator", "nsensordata")
    )
    n_userdata_at, userdata_at = model_at["nuserdata"], data_at["userdata"]
    n_numeric_at, n_numericdata_at = model_at["nnumeric"], model_at["nnumericdata"]
    adr_at, size_at, values_at = (
        model_at[name] for name in ("numeric_adr", "numeric_size", "numeric_data")
    )
    user_at, parameters_at = model_at["actuator_user"], model_at["actuator_biasprm"]
    ctrl_at, sensors_at, time_at = (
        data_at["ctrl"],
        data_at["sensordata"],
        byte_offset("mjData", "time"),
    )

    @numba.njit(cache=True)
    def found(model):
        """Where the reservoir's block begins in the custom numerics, and its size; -1 without."""
        addresses, sizes = integers(model[adr_at]), integers(model[size_at])
        values = doubles(model[values_at])
        for i in range(model[n_numeric_at]):
            fits = sizes[i] >= _HEAD and 0 <= addresses[i] <= model[n_numericdata_at] - sizes[i]
            if fits and values[addresses[i]] == RESERVOIR_TAG:
                return numba.int64(addresses[i]), numba.int64(sizes[i])
        return numba.int64(-1), numba.int64(0)

    @numba.njit(cache=True)
    def inside(value, end):
        """Whether a number of a model is a whole one from 0 to end - 1; NaN is not."""
        return 0.0 <= value < end and value == np.floor(value)

    @numba.njit(cache=True, fastmath=_FAST)
    def output(model, sensors, addresses, n_signals, channel):
        """y of a channel, its gate applied."""
        gate = doubles(model[parameters_at])[channel * N_BIAS_PARAMETERS]
        if gate == 0.0:
            return 0.0
        weights = doubles(model[user_at] + 8 * model[n_user_at] * channel)
        total = 0.0
        for j in range(n_signals):
            total += weights[j] * sensors[numba.int64(addresses[j])]
        return gate * (total + weights[n_signals])

    def control(model, data):
        start, size = found(model)
        if start < 0:
            return
        values = numba.carray(doubles(model[values_at] + 8 * start), size)
        nu, n_data = model[nu_at], model[n_data_at]
        whole = inside(values[1], nu + 1) and inside(values[2], nu) and inside(values[3], n_data)
        whole &= inside(values[4], model[n_user_at]) and inside(values[5], values[4] + 1.0)
        if not (whole and inside(values[6], size) and inside(values[8], model[n_userdata_at] + 1)):
            return  # a model that mcmj did not write
        n_outputs, first, clock = (
            numba.int64(values[1]), numba.int64(values[2]), numba.int64(values[3]),
        )  # fmt: skip
        n_signals, n_late, n_drives = (
            numba.int64(values[4]), numba.int64(values[5]), numba.int64(values[6]),
        )  # fmt: skip
        memory, n_heard = numba.int64(values[8]), n_signals + n_late
        if n_signals < 1 or _HEAD + n_heard + 3 * n_drives != size or first + n_outputs > nu:
            return
        if n_late > 0 and memory + 1 + n_late > model[n_userdata_at]:
            return
        sensors, ctrl = doubles(data[sensors_at]), doubles(data[ctrl_at])
        time = doubles(address_of(data) + time_at)[0]
        if sensors[clock] != time:
            return  # a later stage of RK4
        addresses, drives = values[_HEAD : _HEAD + n_heard], values[_HEAD + n_heard :]
        for j in range(n_heard):
            if not inside(addresses[j], n_data):
                return
        for k in range(n_drives):
            if not (inside(drives[3 * k], first) and inside(drives[3 * k + 1], nu - first)):
                return
        if n_late > 0:
            kept = doubles(data[userdata_at] + 8 * memory)
            if kept[0] == 1.0:  # restored
                for j in range(n_late):
                    sensors[numba.int64(addresses[n_signals + j])] = kept[1 + j]
                kept[0] = 0.0
        for k in range(n_drives):
            ctrl[numba.int64(drives[3 * k])] = 0.0
        last, value = -1, 0.0
        for k in range(n_drives):  # those of a channel are neighbours
            channel = numba.int64(drives[3 * k + 1])
            if channel != last:
                last, value = channel, ctrl[first + channel]
                if channel < n_outputs and time >= values[7]:
                    value += output(model, sensors, addresses, n_signals, first + channel)
            ctrl[numba.int64(drives[3 * k])] += drives[3 * k + 2] * value

    return numba.cfunc(types.void(WORDS, WORDS), cache=True)(control).ctypes
