"""The command: filters."""

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.filters.config import Config
from mcmj.experiments.filters.figure import figures
from mcmj.experiments.filters.result import Result
from mcmj.experiments.filters.run import run
from mcmj.utils.progress import progress_bar


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table = Table(title="NRMSE (std) on held-out data")
    for column in ("task", "body", "input and its delays", "input only"):
        table.add_column(column, justify="left" if column == "task" else "right")
    for name, one in result.filters.items():
        errors = (one.errors[f"{kind}nrmse_std"] for kind in ("", "baseline_", "input_only_"))
        table.add_row(name, *(f"{error:.4f}" for error in errors))
    console.print(table)
    if result.switch is not None:
        values = result.switch.metrics
        for name, mark in (("with feedback", ""), ("without", "baseline_")):
            console.print(
                f"switch {name}: NRMSE {values[f'{mark}nrmse_std']:.3f}, right throughout "
                f"{100 * values[f'{mark}pauses_held']:.0f} % of the pauses"
            )


EXPERIMENT = Experiment(
    name="filters",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar("tasks", len(config.tasks), quiet=quiet),
    figures=figures,
)
