"""The command: capacity."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.capacity.figure import capacity_figure
from mcmj.experiments.capacity.run import Config, Result, run, total_bodies
from mcmj.experiments.command_line import Output, main
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("bodies", total_bodies(config), quiet=output.quiet) as on_bodies:
        result = run(config, on_bodies=on_bodies)
    axes = {
        "stiffness_damping": ("stiffness factor", config.stiffness, "damping factor",
                              config.damping),
        "size_strength": ("nodes", config.sizes, "input strength [N]", config.strengths),
    }  # fmt: skip
    maps = {name: (*axes[name], measures) for name, measures in result.maps.items()}
    save(capacity_figure(result.by_delay, maps), out / "capacity.png")
    files.write_metrics(out / "metrics.json", "capacity", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    table = Table(title=f"a body of {result.n_springs} springs, {result.config.symbols} symbols")
    table.add_column("measure")
    table.add_column("value", justify="right")
    for name, value in result.worth.measures.items():
        table.add_row(name, f"{value:.1f}")
    for degree, values in result.by_delay.items():
        table.add_row(f"capacity of degree {degree}", f"{sum(values):.1f}")
    console = Console()
    console.print(table)
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("capacity", Config, work, arguments)
