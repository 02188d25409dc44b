"""The command: prune."""

from pathlib import Path

import numpy as np
from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.prune.config import Config, total_runs
from mcmj.experiments.prune.figure import figures
from mcmj.experiments.prune.result import Result
from mcmj.experiments.prune.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """Errors, and the order in which springs are left out."""
    config, first = result.config, result.bodies[0]
    arrays = {f"{m}/errors": result.errors(m) for m in config.methods}
    arrays |= {f"{m}/order": first.orders[m] for m in config.methods}
    files.write_arrays(folder / "prune.npz", arrays, config, config.of_seed(0).noise_seed)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    title = f"orbit error below {100 * config.threshold:g} %, {config.seeds} bodies"
    columns = [name for m in config.methods for name in (f"{m}: bodies", "median error")]
    table = table_of(title, "springs sensed", *columns, words=0)
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
    bar=counting("free runs", total_runs),
    seed=lambda config: config.of_seed(0).noise_seed,
    write=write,
    figures=figures,
)
