"""The command: filters."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.filters.figure import filter_figure, switch_figure
from mcmj.experiments.filters.run import IN_SYMBOLS, TIMESTEP, Config, Result, run
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("tasks", len(config.tasks), quiet=output.quiet) as on_tasks:
        result = run(config, on_tasks=on_tasks)
    if result.filters:
        panels = {
            name: (1.0 if name in IN_SYMBOLS else TIMESTEP, r.wanted, r.outputs, r.errors)
            for name, r in result.filters.items()
        }
        save(filter_figure(panels, in_symbols=IN_SYMBOLS), out / "filters.png")
    if result.switch is not None:
        s = result.switch
        figure = switch_figure(TIMESTEP, s.task.inputs, s.task.targets, s.outputs, s.held)
        save(figure, out / "switch.png")
    files.write_metrics(out / "metrics.json", "filters", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    table = Table(title="NRMSE (std) on held-out data")
    for column in ("task", "body", "input and its delays", "input only"):
        table.add_column(column, justify="left" if column == "task" else "right")
    for name, one in result.filters.items():
        errors = (one.errors[f"{kind}nrmse_std"] for kind in ("", "baseline_", "input_only_"))
        table.add_row(name, *(f"{error:.4f}" for error in errors))
    console = Console()
    console.print(table)
    if result.switch is not None:
        values = result.switch.metrics
        for name, mark in (("with feedback", ""), ("without", "baseline_")):
            console.print(
                f"switch {name}: NRMSE {values[f'{mark}nrmse_std']:.3f}, right throughout "
                f"{100 * values[f'{mark}pauses_held']:.0f} % of the pauses"
            )
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("filters", Config, work, arguments)
