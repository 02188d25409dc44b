"""The command: linearise."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.linearise.figure import figures
from mcmj.experiments.linearise.run import Config, Result, run, total_arrays
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """The reports on linearisability."""
    files.write_text(folder / "linearisability.txt", report(result))


def report(result: Result) -> str:
    """All reports on linearisability."""
    return "\n\n".join(str(one) for one in result.reports) + "\n"


def show(result: Result, console: Console) -> None:
    """The reports, then the arrays as a table."""
    print(report(result))
    config = result.config
    columns = [f"rank of {2 * n}" for n in config.sizes]
    columns += [f"NRMSE, {n} springs" for n in config.memory_sizes]
    title = "arrays of linear springs, from diverse to equal"
    table = table_of(title, "diversity", *columns, words=0)
    for place, spread in enumerate(config.spreads):
        ranks = [str(result.ranks[n][place]) for n in config.sizes]
        errors = [f"{result.errors[n][place]:.3f}" for n in config.memory_sizes]
        table.add_row(f"{spread:g}", *ranks, *errors)
    console = Console(width=20 + 13 * (len(config.sizes) + len(config.memory_sizes)))
    console.print(table)
    console.print(f"the same filter without a body: NRMSE {result.baseline:.3f}")


EXPERIMENT = Experiment(
    name="linearise",
    config=Config,
    run=run,
    show=show,
    bar=counting("arrays", total_arrays),
    write=write,
    figures=figures,
)
