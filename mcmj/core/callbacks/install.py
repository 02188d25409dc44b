"""The compiled callbacks, run in C: each of MuJoCo's kinds is installed here.

    mjcb_act_bias   readout_law.py      feedback of bodies with tendons
    mjcb_passive    passive.py          springs, spring laws, the leapfrog
    mjcb_sensor     length_sensors.py   lengths of springs that are no tendons
    mjcb_control    reservoir_law.py    the law of reservoirs in any model

All callbacks do nothing in models without a tag of ours, so others in the process are safe. MuJoCo
holds one callback of each kind per process: `install` refuses to replace one that is not
ours, and `uninstall` takes ours out again.
"""

import os
import threading
from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numba
from numba import types

from mcmj.core.callbacks.length_sensors import compile_sensors
from mcmj.core.callbacks.offsets import word_offsets
from mcmj.core.callbacks.passive import compile_passive
from mcmj.core.callbacks.pointers import WORDS, CFunction
from mcmj.core.callbacks.readout_law import COMPILE, fed_back
from mcmj.core.callbacks.reservoir_law import compile_control
from mcmj.utils.errors import McmjError

_lock = threading.Lock()
if hasattr(os, "register_at_fork"):  # else a child waits for a thread that it does not have
    os.register_at_fork(
        before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release
    )


class Offsets(NamedTuple):
    """Where the readout law's fields are in mjModel and mjData, in words."""

    nuser_actuator: int
    nsensordata: int
    actuator_user: int
    actuator_biasprm: int
    sensordata: int


def _compile_readout() -> CFunction:
    """The mjcb_act_bias callback. Offsets are a closure variable: Numba's cache keys on them."""
    model_fields, data_fields = Offsets._fields[:4], Offsets._fields[4:]
    words = word_offsets("mjModel", model_fields) | word_offsets("mjData", data_fields)
    at = Offsets(**words)

    def readout(model, data, actuator):
        return fed_back(model, data, at, actuator)

    signature = types.float64(WORDS, WORDS, types.int32)
    return numba.cfunc(signature, **COMPILE)(readout).ctypes


class _Callback:
    """One of MuJoCo's global callbacks, compiled at first use, installed once, by any thread."""

    def __init__(self, name: str, compile_: Callable[[], CFunction]):
        self.name = name
        self._compile = compile_
        self._function: CFunction | None = None

    def _installed(self) -> object:
        return getattr(mujoco, f"get_{self.name}")()

    def install(self) -> None:
        with _lock:  # else a second thread compiles the same, and takes it for another's
            self._install()

    def _install(self) -> None:
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
_SENSORS = _Callback("mjcb_sensor", compile_sensors)
_CONTROL = _Callback("mjcb_control", compile_control)


def install_control() -> None:
    """Install the law of reservoirs in any model; idempotent.

    Raises:
        McmjError: another package's callback of that kind is installed.
    """
    _CONTROL.install()


def install(*, passive: bool = False, sensors: bool = False) -> None:
    """Install the readout callback, and the others if asked; idempotent.

    Args:
        passive: springs that are no tendons, custom spring laws, or an integrator by callback.
        sensors: lengths of springs that are no tendons.

    Raises:
        McmjError: another package's callback of that kind is installed.
    """
    _READOUT.install()
    if passive:
        _PASSIVE.install()
    if sensors:
        _SENSORS.install()


def uninstall() -> None:
    """Take our callbacks out of MuJoCo; others' stay. Loops are then open, integrators MuJoCo's."""
    _READOUT.uninstall()
    _CONTROL.uninstall()
    _PASSIVE.uninstall()
    _SENSORS.uninstall()
