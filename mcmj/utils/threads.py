"""Independent runs side by side on all cores, in one process: rollouts release the GIL."""

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from threading import Event
from typing import TypeVar

import scipy.linalg  # noqa: F401  (its library is to be found)
from threadpoolctl import ThreadpoolController

from mcmj.utils.progress import OnSteps

T = TypeVar("T")
R = TypeVar("R")


class _StoppedError(Exception):
    """Ends a run whose result nobody wants any more."""


def one_blas_thread() -> AbstractContextManager[object]:
    """A block in which linear algebra is done in one thread: the same bits on any machine."""
    limit: AbstractContextManager[object] = _blas().limit(limits=1)
    return limit


@functools.cache  # looking for libraries takes milliseconds
def _blas() -> ThreadpoolController:
    return ThreadpoolController().select(user_api="blas")


def in_threads(work: Callable[[T, OnSteps], R], items: Sequence[T], on_steps: OnSteps) -> list[R]:
    """Results of work(item, on_steps), in the items' order; they do not depend on the cores.

    An exception in one, or an interrupt, stops the others at the next time they report steps.
    """
    stopped = Event()

    def report(steps: int) -> None:
        if stopped.is_set():
            raise _StoppedError
        on_steps(steps)

    # BLAS threads on top would wait for each other
    with one_blas_thread(), ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = [pool.submit(work, item, report) for item in items]
        try:
            done, _ = wait(runs, return_when=FIRST_EXCEPTION)
            for run in done:
                run.result()
        except BaseException:
            stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return [run.result() for run in runs]
