"""Simulations with threads in a forked process: its threads are not there, and are waited for."""

import ctypes
import os
from typing import Any
from weakref import WeakSet

from mcmj.utils.errors import McmjError

_threaded: WeakSet[Any] = WeakSet()


class _Lost:
    """Stands for a batch whose threads stayed in the parent."""

    def __getattr__(self, name: str) -> Any:
        raise McmjError(
            "this simulation has threads and was made before the process forked, which took none "
            "of them along; make it in the child, or start processes by 'spawn'"
        )


def guard_against_forks(engine: Any) -> None:
    """From now on, a forked child that uses this engine's `batch` gets an error, not a hang."""
    _threaded.add(engine)


def _lose_batches() -> None:
    for engine in list(_threaded):
        # never freed: its destructor, too, would wait for the threads
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(engine.batch))
        engine.batch = _Lost()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    os.register_at_fork(after_in_child=_lose_batches)
