"""Keep MuJoCo from printing warnings and writing MUJOCO_LOG.TXT: we report them ourselves."""

import ctypes
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

_lock = threading.Lock()
if hasattr(os, "register_at_fork"):  # else a child waits for a thread that it does not have
    os.register_at_fork(
        before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release
    )
_depth = 0
_before: object = None


# warning counters in mjData say the same, per simulation
_IGNORE = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Silence MuJoCo's warning handler inside the block; nests, also across threads."""
    global _depth, _before
    with _lock:
        if _depth == 0:
            _before = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(_IGNORE)
        _depth += 1
    try:
        yield
    finally:
        with _lock:
            _depth -= 1
            if _depth == 0:
                mujoco.set_mju_user_warning(_before)
