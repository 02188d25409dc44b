"""The command: filters."""

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.filters.config import Config
from mcmj.experiments.filters.figure import figures
from mcmj.experiments.filters.result import Result
from mcmj.experiments.filters.run import run


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    title = "NRMSE (std) on held-out data"
    columns = ("task", "body", "input and its delays", "input only")
    table = table_of(title, *columns)
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
    bar=counting("tasks", lambda config: len(config.tasks)),
    figures=figures,
)
