"""The command: benchmark."""

from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.benchmark.config import Config
from mcmj.experiments.benchmark.figure import figures
from mcmj.experiments.benchmark.run import PARTS, Result, run
from mcmj.utils import files


def show(result: Result, console: Console) -> None:
    """The result as a table."""
    metrics: Any = files.plain(result.metrics)
    table = Table(title="ratios are medians measured side by side", show_header=False)
    for name, value in metrics.items():
        rows = value.items() if isinstance(value, dict) else [("", value)]
        for key, number in rows:
            if name != "growth":
                shown = f"{number:.3g}" if isinstance(number, float) else str(number)
                table.add_row(f"{name} {key}".strip(), shown)
    console.print(table)


EXPERIMENT = Experiment(
    name="benchmark",
    config=Config,
    run=run,
    show=show,
    bar=counting("measuring", lambda config: len(PARTS)),
    figures=figures,
)
