"""Where trials run: in this process, in processes of this machine, or on a Dask cluster."""

import multiprocessing
import os
import re
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import Any, Protocol, TypeVar

from mcmj.utils.errors import InvalidArgumentError, McmjError
from mcmj.utils.extras import extra
from mcmj.utils.validation import require_count

T = TypeVar("T")
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PATIENCE = 5.0  # s for a scheduler to answer


class Workers(Protocol):
    """What the runner needs of a place to run."""

    @property
    def count(self) -> int:
        """Number of trials that run at once."""

    def submit(self, task: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run a function of a module soon."""

    def lost(self, error: BaseException) -> bool:
        """Whether a future's error is a worker's death, so that the task may be submitted again."""

    def close(self) -> None:
        """Let go; tasks that have not begun do not."""


class Inline:
    """One task at a time, here and now."""

    count = 1

    def submit(self, task: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run it at once; its error is the future's, an interrupt is raised."""
        future: Future[T] = Future()
        try:
            future.set_result(task(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def lost(self, error: BaseException) -> bool:
        """Never."""
        return False

    def close(self) -> None:
        """Nothing to do."""


class Processes:
    """Processes of this machine, one thread each; they end with this one, however it ends.

    Args:
        count: number of processes.
    """

    def __init__(self, count: int) -> None:
        require_count("workers", count, 1)
        self.count = count
        self._pool = self._start()

    def _start(self) -> Executor:
        # spawned, not forked: forking a process with threads may hang its children
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self.count, mp_context=context, initializer=_start_worker)

    def submit(self, task: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run it in one of the processes; a new set of them if one of the old was killed."""
        try:
            with _one_thread_each():
                return self._pool.submit(task, *arguments)
        except BrokenExecutor:
            self._pool.shutdown(wait=False)
            self._pool = self._start()
            with _one_thread_each():
                return self._pool.submit(task, *arguments)

    def lost(self, error: BaseException) -> bool:
        """A process was killed: all that its pool had not finished is lost."""
        return isinstance(error, BrokenExecutor)

    def close(self) -> None:
        """Wait for the tasks that run."""
        self._pool.shutdown(cancel_futures=True)


class Cluster:
    """The workers of a Dask cluster; a task of a worker that dies goes to another one.

    Args:
        scheduler: its address, as in tcp://host:8786.

    Raises:
        MissingExtraError: dask.distributed is not installed.
        McmjError: no scheduler answers.
        InvalidArgumentError: a cluster without workers.
    """

    def __init__(self, scheduler: str, *, patience: float = 30.0) -> None:
        with extra("cluster", "a cluster needs Dask"):
            from distributed import Client, KilledWorker
        _check_answers(scheduler)
        try:
            self._client = Client(scheduler, timeout=patience, set_as_default=False)
            self._client.wait_for_workers(1, timeout=patience)
        except (OSError, TimeoutError, ValueError) as error:
            raise InvalidArgumentError(
                "scheduler", "the address of a Dask scheduler with workers", f"{scheduler}: {error}"
            ) from error
        self._died = (KilledWorker,)
        self._pool = self._client.get_executor(pure=False)

    @property
    def count(self) -> int:
        """Threads of all workers now: they may come and go."""
        return max(1, int(sum(self._client.nthreads().values())))

    def submit(self, task: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run it somewhere."""
        found: Future[T] = self._pool.submit(task, *arguments)
        return found

    def lost(self, error: BaseException) -> bool:
        """Dask gives up a task whose workers died several times."""
        return isinstance(error, self._died)

    def close(self) -> None:
        """Cancel what is not done, and leave the cluster as it was."""
        self._pool.shutdown(wait=False)
        self._client.close()


def _check_answers(scheduler: str) -> None:
    """Dask itself waits for long, and says little, where nobody listens."""
    expected = "the address of a Dask scheduler, as in tcp://host:8786"
    match = re.fullmatch(r"(?:([a-z]+)://)?\[?([^/\[\]]+)\]?:(\d{1,5})", scheduler)
    if match is None:
        raise InvalidArgumentError("scheduler", expected, repr(scheduler))
    if match[1] not in (None, "tcp", "tls"):
        return
    try:
        socket.create_connection((match[2], int(match[3])), timeout=PATIENCE).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise InvalidArgumentError("scheduler", expected, f"{scheduler}: {error}") from error


@contextmanager
def open_workers(count: int | None, scheduler: str | None) -> Iterator[Workers]:
    """Workers of a cluster if a scheduler is given; else `count` processes (None: all cores).

    Raises:
        McmjError, InvalidArgumentError: no such cluster, or a wrong number.
    """
    if scheduler is not None:
        workers: Workers = Cluster(scheduler)
    else:
        number = _cores() if count is None else count
        workers = Inline() if number == 1 else Processes(number)
    try:
        yield workers
    finally:
        workers.close()


def results(
    workers: Workers, task: Callable[..., T], arguments: Sequence[tuple[Any, ...]]
) -> list[T]:
    """The task's results for all arguments, in their order."""
    futures = [workers.submit(task, *some) for some in arguments]
    try:
        return [future.result() for future in futures]
    except (BrokenExecutor, CancelledError) as error:
        raise McmjError("a worker was killed; run the same command again") from error


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes that start inside the block do their linear algebra in one thread."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start_worker() -> None:
    """End with the parent, even if it is killed; leave interrupts to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
