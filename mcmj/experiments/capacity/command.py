"""The command: capacity."""

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.capacity.config import Config, total_bodies
from mcmj.experiments.capacity.figure import figures
from mcmj.experiments.capacity.result import Result
from mcmj.experiments.capacity.run import run


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    kind = "body" if result.config.reservoir is None else "reservoir"
    counted = f"{result.n_signals} {result.signals.removeprefix('n_')}"
    title = f"a {kind} of {counted}, {result.config.symbols} symbols"
    table = table_of(title, "measure", "value")
    for name, value in result.worth.measures.items():
        table.add_row(name, f"{value:.1f}")
    for degree, values in result.by_delay.items():
        table.add_row(f"capacity of degree {degree}", f"{sum(values):.1f}")
    console.print(table)


EXPERIMENT = Experiment(
    name="capacity",
    config=Config,
    run=run,
    show=show,
    bar=counting("bodies", total_bodies),
    figures=figures,
)
