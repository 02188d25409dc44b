"""The command: prune."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.prune.run import Config, Result, run, total_runs
from mcmj.experiments.search.figure import pruning_figure
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("free runs", total_runs(config), quiet=output.quiet) as on_runs:
        result = run(config, on_runs=on_runs)
    first = result.bodies[0]
    method = config.methods[0]
    figure = pruning_figure(
        config.counts,
        {m: result.errors(m) for m in config.methods},
        np.array([body.full_error for body in result.bodies]),
        config.threshold,
        body=first.body,
        sensed=first.orders[method][: result.needed(method, 0) or 0],
    )
    save(figure, out / "prune.png")
    seed = config.of_seed(0).noise_seed
    arrays = {f"{m}/errors": result.errors(m) for m in config.methods}
    arrays |= {f"{m}/order": first.orders[m] for m in config.methods}
    files.write_arrays(out / "prune.npz", arrays, config, seed)
    files.write_metrics(out / "metrics.json", "prune", config, seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
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
    console = Console()
    console.print(table)
    full = np.array([body.full_error for body in result.bodies])
    console.print(
        f"all springs: {int((full < config.threshold).sum())} of {len(full)}, "
        f"median error {100 * np.median(full):.3g} %"
    )
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("prune", Config, work, arguments)
