"""The command: benchmark."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.benchmark.run import PARTS, Config, run
from mcmj.experiments.command_line import Output, main
from mcmj.pictures import plotting
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("measuring", len(PARTS), quiet=output.quiet) as on_parts:
        result = run(config, on_parts=on_parts)
    metrics = files.plain(result.metrics)
    assert isinstance(metrics, dict)
    files.write_metrics(out / "metrics.json", "benchmark", config, config.seed, metrics)
    plotting.save(plotting.growth_figure(metrics["growth"]), out / "growth.png")
    if not output.quiet:
        show(metrics, out)


def show(metrics: dict, out: Path) -> None:
    table = Table(title="ratios are medians measured side by side", show_header=False)
    for name, value in metrics.items():
        rows = value.items() if isinstance(value, dict) else [("", value)]
        for key, number in rows:
            if name != "growth":
                shown = f"{number:.3g}" if isinstance(number, float) else str(number)
                table.add_row(f"{name} {key}".strip(), shown)
    console = Console()
    console.print(table)
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("benchmark", Config, work, arguments)
