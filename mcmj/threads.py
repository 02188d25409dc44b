"""Independent runs side by side on all cores, in one process: rollouts release the GIL."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from typing import TypeVar

from threadpoolctl import threadpool_limits

from mcmj.progress import OnSteps

T = TypeVar("T")
R = TypeVar("R")


def in_threads(work: Callable[[T, OnSteps], R], items: Sequence[T], on_steps: OnSteps) -> list[R]:
    """Results of work(item, on_steps), in the items' order; they do not depend on the cores.

    An exception or an interrupt stops the other runs at the next time they report steps.
    """
    stopped = Event()

    def report(steps: int) -> None:
        if stopped.is_set():
            raise InterruptedError
        on_steps(steps)

    # BLAS threads on top would wait for each other
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            return list(pool.map(lambda item: work(item, report), items))
        except BaseException:
            stopped.set()
            raise
