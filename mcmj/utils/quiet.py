"""Functions that MuJoCo calls on the side, put aside while mcmj is at work.

Its warnings, which it prints and writes to MUJOCO_LOG.TXT: we report them ourselves. And its clock,
asked 14 times a step for timers that nobody reads: a sixth of a step of a small body.
"""

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

import mujoco
import numba
from numba import types

from mcmj.utils.compiled_cache import ensure_cache

_lock = threading.Lock()
if hasattr(os, "register_at_fork"):  # else a child waits for a thread that it does not have
    os.register_at_fork(
        before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release
    )


class _Replaced:
    """A global function of MuJoCo, replaced by another one within blocks.

    The blocks nest, also across threads.
    """

    def __init__(self, get: Callable[[], object], put: Callable[[object], None]) -> None:
        self._get, self._put = get, put
        self._depth, self._before = 0, None

    def begin(self, function: object) -> None:
        with _lock:
            if self._depth == 0:
                self._before = self._get()  # type: ignore[assignment]
                self._put(function)
            self._depth += 1

    def end(self) -> None:
        with _lock:
            self._depth -= 1
            if self._depth == 0:
                self._put(self._before)


_warnings = _Replaced(mujoco.get_mju_user_warning, mujoco.set_mju_user_warning)
_clock = _Replaced(mujoco.get_mjcb_time, mujoco.set_mjcb_time)

# warning counters in mjData say the same, per simulation
_IGNORE = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Silence MuJoCo's warning handler inside the block."""
    _warnings.begin(_IGNORE)
    try:
        yield
    finally:
        _warnings.end()


@contextmanager
def untimed() -> Iterator[None]:
    """Quiet, and MuJoCo's clock stands still; mjData's timers of these steps mean nothing."""
    _clock.begin(_stopped_clock())
    try:
        with quiet_warnings():
            yield
    finally:
        _clock.end()


@cache
def _stopped_clock() -> object:
    ensure_cache()

    def now() -> float:
        return 0.0

    return numba.cfunc(types.float64(), cache=True)(now).ctypes
