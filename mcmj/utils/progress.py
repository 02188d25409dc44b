"""Progress bars with an estimate of the time left; `quiet` shows none."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

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
        yield lambda steps: bar.advance(task, steps)


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
            best = max(best, score) if maximise else min(best, score)
            speed = bar.tasks[0].speed
            rate = f"{speed:.1f} a second" if speed else ""
            bar.update(task, advance=1, rate=rate, best=f"best {best:.3g}")

        yield on_trial
