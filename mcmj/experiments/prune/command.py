"""The command: prune."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.prune.config import Config, total_runs
from mcmj.experiments.prune.figure import figures
from mcmj.experiments.prune.result import Result
from mcmj.experiments.prune.run import run
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def write(result: Result, folder: Path) -> None:
    """Errors, and the order in which springs are left out."""
    config, first = result.config, result.bodies[0]
    arrays = {f"{m}/errors": result.errors(m) for m in config.methods}
    arrays |= {f"{m}/order": first.orders[m] for m in config.methods}
    files.write_arrays(folder / "prune.npz", arrays, config, config.of_seed(0).noise_seed)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    table = Table(title=f"orbit error below {100 * config.threshold:g} %, {config.seeds} bodies")
    table.add_column("springs sensed", justify="right")
    for method in config.methods:
        table.add_column(f"{method}: bodies", justify="right")
        table.add_column("median error", justify="right")
    for k, count in enumerate(config.counts):
        cells = [str(count)]
        for method in config.methods:
            errors = result.errors(method)[:, k]
            good = int((errors < config.threshold).sum())
            cells += [f"{good} of {len(errors)}", f"{100 * np.median(errors):.3g} %"]
        table.add_row(*cells)
    console.print(table)
    full = result.full_errors
    console.print(
        f"all springs: {int((full < config.threshold).sum())} of {len(full)}, "
        f"median error {100 * np.median(full):.3g} %"
    )


EXPERIMENT = Experiment(
    name="prune",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar("free runs", total_runs(config), quiet=quiet),
    seed=lambda config: config.of_seed(0).noise_seed,
    write=write,
    figures=figures,
)
