"""The readout law of a body's feedback channels, compiled.

    g_c (sum_j user[c, j] s_j + user[c, n])     s = length sensors

Actuator c carries biasprm = [gate g_c, TAG, address of the first sensor, number of sensors, 1 if
they are delayed], and the weights (and, if there is room, the readout's bias) as user data. In
models with tendons it is the actuator's bias force (install.py); in models without, a channel's
force is this plus ctrl, on the degrees of freedom that the spring table says (spring_table.py).
"""

from typing import Any

import numba
from numba import int64, njit

from mcmj.core.callbacks.pointers import TAG, doubles

N_BIAS_PARAMETERS = 10  # mjNBIAS
# NaN and infinity keep their meaning
COMPILE: dict[str, Any] = {"cache": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}}


@njit(**COMPILE)
def fed_back(model, data, at, actuator):
    """g y of an actuator that is a channel, else 0. `at`: offsets in words."""
    parameters = doubles(model[at.actuator_biasprm])
    first = actuator * N_BIAS_PARAMETERS
    gate = parameters[first]
    if parameters[first + 1] != TAG or gate == 0.0:
        return 0.0
    n_user, start, count = model[at.nuser_actuator], parameters[first + 2], parameters[first + 3]
    inside = start >= 0.0 and 1.0 <= count <= n_user and start + count <= model[at.nsensordata]
    if not inside:  # also NaN: a model that mcmj did not write
        return 0.0
    n_sensors = int64(count)
    weights = numba.carray(doubles(model[at.actuator_user] + 8 * n_user * actuator), n_user)
    sensors = numba.carray(doubles(data[at.sensordata] + 8 * int64(start)), n_sensors)
    if parameters[first + 4] != 0.0 and sensors[0] == 0.0:
        return 0.0  # a delayed sensor that has nothing to show yet
    output = 0.0
    for j in range(n_sensors):
        output += weights[j] * sensors[j]
    if n_user > n_sensors:
        output += weights[n_sensors]
    return gate * output


@njit(**COMPILE)
def add_channels(model, data, at, table, force):
    """force (nv,) += shares of all channels of a spring table, times ctrl plus what is fed back."""
    ctrl, shares, nv = doubles(data[at.ctrl]), doubles(table.shares), model[at.nv]
    for channel in range(table.channels):
        size = ctrl[channel] + fed_back(model, data, at, channel)
        if size == 0.0:
            continue
        for i in range(nv):
            force[i] += size * shares[channel * nv + i]
