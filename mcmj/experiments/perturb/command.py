"""The command: perturb."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.perturb.figure import perturb_figure, tolerance_figure
from mcmj.experiments.perturb.run import Config, Result, run, total_steps
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("teaching, disturbing", total_steps(config), quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    first = result.bodies[0]
    runs = {
        name: (r.times, r.outputs, r.clean, r.boundaries, r.orbit_error, r.recovery_time)
        for name, r in first.recoveries.items()
    }
    save(perturb_figure(result.target, runs), out / "perturb.png")
    if config.noise_curve:
        errors = np.array([body.noise_errors for body in result.bodies])
        figure = tolerance_figure(config.noise_curve, errors, config.tolerance)
        save(figure, out / "noise_tolerance.png")
    arrays = {f"{name}/outputs": r.outputs for name, r in first.recoveries.items()}
    files.write_arrays(out / "trajectory.npz", arrays, config, config.seed)
    files.write_metrics(out / "metrics.json", "perturb", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    config, first = result.config, result.bodies[0]
    table = Table(title=f"disturbed for {config.window:g} s, then free for {config.after:g} s")
    for column in ("perturbation", "orbit error", "recovery time"):
        table.add_column(column, justify="left" if column == "perturbation" else "right")
    if config.seeds > 1:
        table.add_column("recovered")
        table.add_column("median recovery time", justify="right")
    for name, r in first.recoveries.items():
        cells = [name, f"{100 * r.orbit_error:.2f} %", f"{r.recovery_time:.2f} s"]
        if config.seeds > 1:
            of_all = result.over_seeds(name)
            cells.append(f"{of_all['successes']} of {of_all['of']}")
            cells.append(f"{of_all['median_recovery_time']:.2f} s")
        table.add_row(*cells)
    console = Console()
    console.print(table)
    console.print(f"undisturbed: orbit error {100 * first.unperturbed_error:.2f} %")
    for k, std in enumerate(config.noise_curve):
        good = sum(body.noise_errors[k] < config.tolerance for body in result.bodies)
        console.print(f"after length noise of {std:g} m: {good} of {config.seeds} recovered")
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("perturb", Config, work, arguments)
