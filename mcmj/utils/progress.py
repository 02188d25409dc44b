"""Progress bars with an estimate of the time left; `quiet` shows none.

While Numba compiles, which it does once a machine, a bar says so: on a terminal in place of its
label, in a log by a line at the beginning and at the end.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from types import CodeType
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)  # fmt: skip

OnSteps = Callable[[int], object]


@contextmanager
def progress_bar(label: str, total: int, *, quiet: bool = False) -> Iterator[OnSteps]:
    """A bar over `total` steps on stderr; the block gets a function that advances it."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=quiet,
        transient=True,
    )
    with bar:
        task = bar.add_task(label, total=total)
        with _compiling(bar, task, label) as over:

            def on_steps(steps: int) -> None:
                over()
                bar.advance(task, steps)

            yield on_steps


@contextmanager
def trial_bar(
    label: str, total: int, *, maximise: bool = False, quiet: bool = False
) -> Iterator[Callable[[float], object]]:
    """A bar over trials with their rate and the best score; the block's function takes scores."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[best]}"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=quiet,
        transient=True,
    )
    best = -inf if maximise else inf
    with bar:
        task = bar.add_task(label, total=total, rate="", best="")

        def on_trial(score: float) -> None:
            nonlocal best
            over()
            best = max(best, score) if maximise else min(best, score)
            speed = bar.tasks[0].speed
            rate = f"{speed:.1f} a second" if speed else ""
            bar.update(task, advance=1, rate=rate, best=f"best {best:.3g}")

        with _compiling(bar, task, label) as over:
            yield on_trial


@contextmanager
def _compiling(bar: Progress, task: TaskID, label: str) -> Iterator[Callable[[], object]]:
    """Says what Numba compiles inside the block, which gets a function that puts the label back."""
    if bar.disable:
        yield lambda: None
        return
    from numba.core import event  # heavy, as the next one

    from mcmj.utils.compiled_cache import FUNCTIONS

    done: set[CodeType] = set()
    began: float | None = None
    in_log = not bar.console.is_terminal

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            nonlocal began
            if event.data["dispatcher"].py_func.__code__ not in FUNCTIONS:
                return
            text = "compiling for this machine, once"
            if began is None:
                began = time.monotonic()
                if in_log:
                    bar.console.print(f"{text}: {len(FUNCTIONS)} functions at most ...")
            count = min(len(done) + 1, len(FUNCTIONS))
            bar.update(task, description=f"{text} (function {count} of at most {len(FUNCTIONS)})")

        def on_end(self, event: Any) -> None:
            done.add(event.data["dispatcher"].py_func.__code__)

    def over() -> None:
        nonlocal began, in_log
        if began is not None:
            bar.update(task, description=label)
            if in_log:
                took = time.monotonic() - began
                bar.console.print(f"compiled {len(done & FUNCTIONS)} functions in {took:.0f} s")
            began, in_log = None, False  # few come later

    with event.install_listener("numba:compile", Listener()):
        yield over
