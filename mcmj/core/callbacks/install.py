"""The compiled callbacks: the readout law here, passive forces in passive.py, run in C.

Readout law (design: one law for every experiment), for feedback channel c with gate g_c:

    bias force of actuator c = g_c (sum_j user[c, j] s_j + user[c, n])     s = length sensors

It is MuJoCo's own actuator law, force = gain * ctrl + bias, with ctrl as the offset. The
actuator carries biasprm = [gate, TAG, address of the first sensor, number of sensors, 1 if
they are delayed] and the weights (and, if there is room, the readout's bias) as user data.

Both callbacks do nothing in models without the TAG, so others in the process are safe. MuJoCo
holds one callback of each kind per process: `install` refuses to replace one that is not
ours, and `uninstall` takes ours out again.
"""

from collections.abc import Callable

import mujoco
import numba
from numba import types

from mcmj.core.callbacks.offsets import word_offsets
from mcmj.core.callbacks.passive import compile_passive
from mcmj.core.callbacks.pointers import TAG, WORDS, CFunction, doubles
from mcmj.core.callbacks.reservoir_law import compile_control
from mcmj.utils.errors import McmjError

N_BIAS_PARAMETERS = 10  # mjNBIAS

_FAST = {"contract", "reassoc", "nsz", "arcp"}  # NaN and infinity keep their meaning


def _compile_readout() -> CFunction:
    """The mjcb_act_bias callback. Offsets are closure variables: Numba's cache keys on them."""
    fields = ("nuser_actuator", "nsensordata", "actuator_user", "actuator_biasprm")
    model_at, data_at = word_offsets("mjModel", fields), word_offsets("mjData", ["sensordata"])
    n_user_at, user_at = model_at["nuser_actuator"], model_at["actuator_user"]
    n_data_at = model_at["nsensordata"]
    parameters_at, sensors_at = model_at["actuator_biasprm"], data_at["sensordata"]

    def readout(model, data, actuator):
        parameters = doubles(model[parameters_at])
        first = actuator * N_BIAS_PARAMETERS
        gate = parameters[first]
        if parameters[first + 1] != TAG or gate == 0.0:
            return 0.0
        n_user, start, count = model[n_user_at], parameters[first + 2], parameters[first + 3]
        inside = start >= 0.0 and 1.0 <= count <= n_user and start + count <= model[n_data_at]
        if not inside:  # also NaN: a model that mcmj did not write
            return 0.0
        n_sensors = numba.int64(count)
        weights = numba.carray(doubles(model[user_at] + 8 * n_user * actuator), n_user)
        sensors = numba.carray(doubles(data[sensors_at] + 8 * numba.int64(start)), n_sensors)
        if parameters[first + 4] != 0.0 and sensors[0] == 0.0:
            return 0.0  # a delayed sensor that has nothing to show yet
        output = 0.0
        for j in range(n_sensors):
            output += weights[j] * sensors[j]
        if n_user > n_sensors:
            output += weights[n_sensors]
        return gate * output

    signature = types.float64(WORDS, WORDS, types.int32)
    return numba.cfunc(signature, cache=True, fastmath=_FAST)(readout).ctypes


class _Callback:
    """One of MuJoCo's global callbacks, compiled at first use, installed once."""

    def __init__(self, name: str, compile_: Callable[[], CFunction]):
        self.name = name
        self._compile = compile_
        self._function: CFunction | None = None

    def _installed(self) -> object:
        return getattr(mujoco, f"get_{self.name}")()

    def install(self) -> None:
        current = self._installed()
        if self._function is not None and current is self._function:
            return
        if current is not None:
            raise McmjError(
                f"another {self.name} is installed in this process ({current!r}), and MuJoCo "
                f"holds only one: remove it with mujoco.set_{self.name}(None) first"
            )
        if self._function is None:
            self._function = self._compile()
        getattr(mujoco, f"set_{self.name}")(self._function)

    def uninstall(self) -> None:
        if self._function is not None and self._installed() is self._function:
            getattr(mujoco, f"set_{self.name}")(None)


_READOUT = _Callback("mjcb_act_bias", _compile_readout)
_PASSIVE = _Callback("mjcb_passive", compile_passive)
_CONTROL = _Callback("mjcb_control", compile_control)


def install_control() -> None:
    """Install the law of reservoirs in any model; idempotent.

    Raises:
        McmjError: another package's callback of that kind is installed.
    """
    _CONTROL.install()


def install(*, passive: bool = False) -> None:
    """Install the readout callback, and that of passive forces if asked; idempotent.

    Args:
        passive: custom spring laws, or an integrator by callback, will be used.

    Raises:
        McmjError: another package's callback of that kind is installed.
    """
    _READOUT.install()
    if passive:
        _PASSIVE.install()


def uninstall() -> None:
    """Take our callbacks out of MuJoCo; others' stay. Loops are then open, integrators MuJoCo's."""
    _READOUT.uninstall()
    _CONTROL.uninstall()
    _PASSIVE.uninstall()
