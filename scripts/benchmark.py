"""Measure every speed claim of mcmj on this machine: ratios, medians, side by side."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj import plotting, store
from mcmj.cli import Output, main
from mcmj.experiments.benchmark import PARTS, Config, run
from mcmj.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("measuring", len(PARTS), quiet=output.quiet) as on_parts:
        result = run(config, on_parts=on_parts)
    metrics = store.plain(result.metrics)
    assert isinstance(metrics, dict)
    store.write_metrics(out / "metrics.json", "benchmark", config, config.seed, metrics)
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


if __name__ == "__main__":
    main("benchmark", Config, work)
