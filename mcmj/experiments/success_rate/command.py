"""The command: success_rate."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mcmj.core.random_body import draw_body
from mcmj.experiments.base import Experiment
from mcmj.experiments.success_rate.run import Config, Result, run
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures import plotting
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def write(result: Result, folder: Path) -> None:
    """The best body."""
    files.write_text(folder / "best.xml", best_body(result))


def figures(result: Result) -> dict[str, Figure]:
    """Orbit errors of all bodies."""
    return {"success_rate": plotting.success_figure(result.orbit_errors, result.config.threshold)}


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


def show(result: Result, console: Console) -> None:
    """The result as tables."""
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
    console.print(table)
    console.print(f"best body: seed {result.best_seed}, written to best.xml")


EXPERIMENT = Experiment(
    name="success_rate",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar("bodies", config.seeds, quiet=quiet),
    seed=lambda config: config.first_seed,
    write=write,
    figures=figures,
)
