"""The command: perturb."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.perturb.config import Config, total_steps
from mcmj.experiments.perturb.figure import figures
from mcmj.experiments.perturb.result import Result
from mcmj.experiments.perturb.run import run
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def write(result: Result, folder: Path) -> None:
    """The first body's disturbed runs."""
    config, first = result.config, result.bodies[0]
    arrays = {f"{name}/outputs": r.outputs for name, r in first.recoveries.items()}
    files.write_arrays(folder / "trajectory.npz", arrays, config, config.seed)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
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
    console.print(table)
    console.print(f"undisturbed: orbit error {100 * first.unperturbed_error:.2f} %")
    for k, std in enumerate(config.noise_curve):
        good = sum(body.noise_errors[k] < config.tolerance for body in result.bodies)
        console.print(f"after length noise of {std:g} m: {good} of {config.seeds} recovered")


EXPERIMENT = Experiment(
    name="perturb",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar(
        "teaching, disturbing", total_steps(config), quiet=quiet
    ),
    write=write,
    figures=figures,
)
