"""The command: emulate."""

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.emulate.config import REPORTED, Config
from mcmj.experiments.emulate.figure import figures
from mcmj.experiments.emulate.result import Result
from mcmj.experiments.emulate.run import run


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    title = f"error of the emulation at {REPORTED:g} ms, {config.horizon:g} s (order)"
    table = table_of(title, "target", *config.integrators)
    for target, methods in result.cells.items():
        cells = []
        for name, steps in methods.items():
            order = result.slopes[target][name]
            cells.append(
                f"{steps[REPORTED].error:.1e} ({'-' if order is None else f'{order:.2f}'})"
            )
        table.add_row(target, *cells)
    console = Console(width=24 + 19 * len(config.integrators))
    console.print(table)
    for name, steps in result.held_at_start.items():
        error = steps[REPORTED].error
        console.print(
            f"driven_duffing, input sampled at the start of the step, {name}: {error:.1e}"
        )
    for size, error in result.mismatch_errors.items():
        console.print(f"van_der_pol, {size:g} of p and q unknown to K: {error:.1e}")


EXPERIMENT = Experiment(
    name="emulate",
    config=Config,
    run=run,
    show=show,
    bar=counting("targets", lambda config: len(config.names)),
    figures=figures,
)
