"""The command: swing_up."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.perturb.figure import swing_up_figure
from mcmj.experiments.swing_up.run import Config, Result, run, total_steps
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("teaching, swinging up", total_steps(config), quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    first, seed = result.bodies[0], config.of_seed(0).noise_seed
    runs = {
        name: (t.target, config.timestep, t.outputs, t.orbit_error, t.swing_up_time)
        for name, t in first.items()
    }
    save(swing_up_figure(runs), out / "swing_up.png")
    arrays = {f"{name}/outputs": task.outputs for name, task in first.items()}
    files.write_arrays(out / "trajectory.npz", arrays, config, seed)
    files.write_metrics(out / "metrics.json", "swing_up", config, seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    config = result.config
    table = Table(title=f"{config.free_run:g} s from total rest")
    for column in ("task", "orbit error", "swing-up time", "rounds of practice", "kicked starts"):
        table.add_column(column, justify="left" if column == "task" else "right")
    for name, task in result.bodies[0].items():
        kicked = task.kicked_fraction
        table.add_row(
            name,
            f"{100 * task.orbit_error:.3f} %",
            f"{task.swing_up_time:.2f} s",
            str(max(0, len(task.practice_errors) - 1)),
            "none" if kicked is None else f"{100 * kicked:.0f} % arrive",
        )
    console = Console()
    console.print(table)
    if config.seeds > 1:
        for name, row in result.rates.items():
            console.print(f"{name}: {row['successes']} of {row['of']} bodies swing up")
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("swing_up", Config, work, arguments)
