"""The command: emulate."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.emulate.figure import emulation_figure
from mcmj.experiments.emulate.run import REPORTED, Config, Result, run
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("targets", len(config.names), quiet=output.quiet) as on_targets:
        result = run(config, on_targets=on_targets)
    figure = emulation_figure(result.orbits, result.cells, result.slopes, result.mismatch_errors)
    save(figure, out / "emulate.png")
    files.write_metrics(out / "metrics.json", "emulate", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    config = result.config
    table = Table(title=f"error of the emulation at {REPORTED:g} ms, {config.horizon:g} s (order)")
    table.add_column("target")
    for name in config.integrators:
        table.add_column(name, justify="right")
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
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("emulate", Config, work, arguments)
