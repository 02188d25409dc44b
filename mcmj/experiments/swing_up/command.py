"""The command: swing_up."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.swing_up.config import Config, total_steps
from mcmj.experiments.swing_up.figure import figures
from mcmj.experiments.swing_up.result import Result
from mcmj.experiments.swing_up.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """The first body's runs from rest."""
    config, seed = result.config, result.config.of_seed(0).noise_seed
    arrays = {f"{name}/outputs": task.outputs for name, task in result.bodies[0].items()}
    files.write_arrays(folder / "trajectory.npz", arrays, config, seed)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    title = f"{config.free_run:g} s from total rest"
    columns = ("task", "orbit error", "swing-up time", "rounds of practice", "kicked starts")
    table = table_of(title, *columns)
    for name, task in result.bodies[0].items():
        kicked = task.kicked_fraction
        table.add_row(
            name,
            f"{100 * task.orbit_error:.3f} %",
            f"{task.swing_up_time:.2f} s",
            str(max(0, len(task.practice_errors) - 1)),
            "none" if kicked is None else f"{100 * kicked:.0f} % arrive",
        )
    console.print(table)
    if config.seeds > 1:
        for name, row in result.rates.items():
            console.print(f"{name}: {row['successes']} of {row['of']} bodies swing up")


EXPERIMENT = Experiment(
    name="swing_up",
    config=Config,
    run=run,
    show=show,
    bar=counting("teaching, swinging up", total_steps),
    seed=lambda config: config.of_seed(0).noise_seed,
    write=write,
    figures=figures,
)
