"""The command: success_rate."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.core.random_body import draw_body
from mcmj.experiments.command_line import Output, main
from mcmj.experiments.success_rate.run import Config, Result, run
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures import plotting
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("bodies", config.seeds, quiet=output.quiet) as on_seeds:
        result = run(config, on_seeds=on_seeds)
    figure = plotting.success_figure(result.orbit_errors, config.threshold)
    plotting.save(figure, out / "success_rate.png")
    files.write_text(out / "best.xml", best_body(result))
    files.write_metrics(
        out / "metrics.json", "success_rate", config, config.first_seed, result.metrics
    )
    if not output.quiet:
        show(result, out)


def best_body(result: Result) -> str:
    """MJCF of the best body, with its provenance; no readout: it is taught in 120 s."""
    seed, config = result.best_seed, result.config
    errors = {name: e[seed - config.first_seed] for name, e in result.orbit_errors.items()}
    provenance = {
        "seed": seed,
        "settings": files.plain(config.settings),
        "selected": f"best of seeds {config.first_seed} to {config.first_seed + config.seeds - 1}",
        "orbit_errors": files.plain(errors),
        "free_run": config.free_run,
        "teaching": files.plain(config.teaching),
        "versions": files.versions(),
    }
    return to_mjcf(draw_body(seed, config.settings), provenance=provenance)


def show(result: Result, out: Path) -> None:
    config = result.config
    table = Table(title=f"orbit error below {100 * config.threshold:g} %")
    for column in ("task", "bodies", "95 % interval", "median orbit error", "median period error"):
        table.add_column(column)
    for name, row in result.metrics.items():
        if name == "best_seed":
            continue
        cells: dict[str, Any] = dict(row)  # type: ignore[call-overload]
        low, high = cells["interval_95"]
        errors = [
            f"{100 * cells[key]:.3f} %" if key in cells else ""
            for key in ("median_orbit_error", "median_period_error")
        ]
        table.add_row(
            name, f"{cells['successes']} of {cells['of']}", f"{low:.2f} to {high:.2f}", *errors
        )
    console = Console()
    console.print(table)
    console.print(f"best body: seed {result.best_seed}, written to {out / 'best.xml'}")
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("success_rate", Config, work, arguments)
