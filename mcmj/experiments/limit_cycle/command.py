"""The command: limit_cycle."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.limit_cycle.config import Config, total_steps
from mcmj.experiments.limit_cycle.run import Result, run
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures import plotting
from mcmj.pictures.rendering import limit_cycle_video
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def write(result: Result, out: Path) -> None:
    """body.xml with all readouts, and the free runs."""
    config, tasks = result.config, result.tasks
    readouts = result.readouts
    xml = to_mjcf(
        result.body,
        timestep=config.timestep,
        integrator=config.integrator,
        w_out=next(iter(readouts.values())),
        readouts=readouts,
        provenance={"body": result.source, "config": files.plain(config)},
    )
    files.write_text(out / "body.xml", xml)
    arrays = {"timestep": np.array(config.timestep)}
    for name, task in tasks.items():
        arrays[f"{name}/start_time"], arrays[f"{name}/outputs"] = task.times[0], task.outputs
    files.write_arrays(out / "trajectory.npz", arrays, config, config.noise_seed)


def figures(result: Result) -> dict[str, Figure]:
    """Fig. 5."""
    figure = plotting.limit_cycle_figure(
        result.body,
        [(task.target, task.times, task.outputs, task.errors) for task in result.tasks.values()],
        free_run=result.config.free_run,
        window=result.config.window,
    )
    return {"limit_cycle": figure}


def write_videos(result: Result, out: Path) -> None:
    """One MP4 a task, of the free run's last part."""
    for name, task in result.tasks.items():
        if task.positions is None:
            continue  # the twin records none
        last = len(task.positions)
        limit_cycle_video(
            out / f"{name}.mp4",
            result.body,
            task.target,
            task.times[-last:],
            task.positions,
            task.outputs[-last:],
        )


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    table = Table(title=f"last {config.window:g} s of {config.free_run:g} s in closed loop")
    for column in ("task", "orbit error", "period error", "amplitude error", "training NRMSE"):
        table.add_column(column, justify="left" if column == "task" else "right")
    for name, task in result.tasks.items():
        errors = task.errors
        table.add_row(
            name,
            f"{100 * errors['orbit_error']:.3f} %",
            f"{100 * errors['period_error']:.4f} %",
            f"{100 * errors['amplitude_error']:.3f} %",
            f"{task.fit.train_nrmse:.2e}" if task.fit else "not taught",
        )
    console.print(table)
    if result.steps_per_second is not None:
        console.print(
            f"{result.body!r}: {result.steps_per_second:,.0f} steps a second in closed loop, "
            f"{result.closed_loop_cost_ratio:.2f} x a bare mj_step loop"
        )


EXPERIMENT = Experiment(
    name="limit_cycle",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar(
        "teaching and running", total_steps(config), quiet=quiet
    ),
    seed=lambda config: config.noise_seed,
    write=write,
    figures=figures,
    film=write_videos,
    clean_up=Result.remove_checkpoints,
    needs_folder=True,
    resumes=True,
)
