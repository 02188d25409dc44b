"""The command: linearise."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.emulate.figure import diversity_figure
from mcmj.experiments.linearise.run import Config, Result, run, total_arrays
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("arrays", total_arrays(config), quiet=output.quiet) as on_arrays:
        result = run(config, on_arrays=on_arrays)
    files.write_text(out / "linearisability.txt", report(result))
    errors = {n: e[:-1] for n, e in result.errors.items()}
    equal = {n: e[-1] for n, e in result.errors.items()}
    figure = diversity_figure(
        config.diversities,
        {n: c[:-1] for n, c in result.conditions.items()},
        {n: r[:-1] for n, r in result.ranks.items()},
        errors,
        equal,
    )
    save(figure, out / "linearise.png")
    files.write_metrics(out / "metrics.json", "linearise", config, config.seed, result.metrics)
    if not output.quiet:
        print(report(result))
        show(result, out)


def report(result: Result) -> str:
    return "\n\n".join(str(one) for one in result.reports) + "\n"


def show(result: Result, out: Path) -> None:
    config = result.config
    table = Table(title="arrays of linear springs, from diverse to equal")
    table.add_column("diversity", justify="right")
    for n in config.sizes:
        table.add_column(f"rank of {2 * n}", justify="right")
    for n in config.memory_sizes:
        table.add_column(f"NRMSE, {n} springs", justify="right")
    for place, spread in enumerate(config.spreads):
        ranks = [str(result.ranks[n][place]) for n in config.sizes]
        errors = [f"{result.errors[n][place]:.3f}" for n in config.memory_sizes]
        table.add_row(f"{spread:g}", *ranks, *errors)
    console = Console(width=20 + 13 * (len(config.sizes) + len(config.memory_sizes)))
    console.print(table)
    console.print(f"the same filter without a body: NRMSE {result.baseline:.3f}")
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("linearise", Config, work, arguments)
