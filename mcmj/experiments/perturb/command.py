"""The command: perturb."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.perturb.config import Config, total_steps
from mcmj.experiments.perturb.figure import figures
from mcmj.experiments.perturb.result import Result
from mcmj.experiments.perturb.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """The first body's disturbed runs."""
    config = result.config
    arrays = {
        f"{task}/{name}/outputs": r.outputs
        for task, one in result.bodies[0].items()
        for name, r in one.recoveries.items()
    }
    files.write_arrays(folder / "trajectory.npz", arrays, config, config.seed)


def show(result: Result, console: Console) -> None:
    """The result as tables, one a task."""
    for task in result.bodies[0]:
        show_task(result, task, console)


def show_task(result: Result, task: str, console: Console) -> None:
    """One task: the first body, and how many of all recover."""
    config, first = result.config, result.bodies[0][task]
    columns = ("recovered", "median recovery time") if config.seeds > 1 else ()
    title = f"{task}: disturbed for {config.window:g} s, then free for {config.after:g} s"
    table = table_of(title, "perturbation", "orbit error", "recovery time", *columns)
    for name, r in first.recoveries.items():
        cells = [name, f"{100 * r.orbit_error:.2f} %", f"{r.recovery_time:.2f} s"]
        if config.seeds > 1:
            of_all = result.over_seeds(task, name)
            cells.append(f"{of_all['successes']} of {of_all['of']}")
            cells.append(f"{of_all['median_recovery_time']:.2f} s")
        table.add_row(*cells)
    console.print(table)
    console.print(f"undisturbed: orbit error {100 * first.unperturbed_error:.2f} %")
    for k, std in enumerate(config.noise_curve):
        good = sum(body[task].noise_errors[k] < config.tolerance for body in result.bodies)
        console.print(f"after length noise of {std:g} m: {good} of {config.seeds} recovered")


EXPERIMENT = Experiment(
    name="perturb",
    config=Config,
    run=run,
    show=show,
    bar=counting("teaching, disturbing", total_steps),
    write=write,
    figures=figures,
)
