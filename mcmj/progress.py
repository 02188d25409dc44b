"""Progress bars with an estimate of the time left; `quiet` shows none."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
