"""The command: limit_cycle."""

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.core.random_body import draw_body
from mcmj.experiments.base import Experiment, counting, table_of, write_body
from mcmj.experiments.limit_cycle.config import Config, total_steps
from mcmj.experiments.limit_cycle.figure import figures
from mcmj.experiments.limit_cycle.result import Result
from mcmj.experiments.limit_cycle.run import run
from mcmj.experiments.limit_cycle.seeds import SuccessOfSeeds
from mcmj.metrics.success_rates import rate_cells
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.rendering import limit_cycle_video
from mcmj.utils import files


def write(result: Result, out: Path) -> None:
    """body.xml with all readouts, and the free runs."""
    config, tasks = result.config, result.tasks
    write_body(result, result.source, out)
    arrays = {"timestep": np.array(result.stepping["timestep"])}
    for name, task in tasks.items():
        arrays[f"{name}/start_time"], arrays[f"{name}/outputs"] = task.times[0], task.outputs
    files.write_arrays(out / "trajectory.npz", arrays, config, config.noise_seed)
    if result.seeds is not None:
        files.write_text(out / "best.xml", best_body(config, result.seeds))


def best_body(config: Config, seeds: SuccessOfSeeds) -> str:
    """MJCF of the best body, with its provenance; no readout: it is soon taught."""
    seed, last = seeds.best_seed, seeds.first_seed + config.seeds - 1
    errors = {name: e[seed - seeds.first_seed] for name, e in seeds.orbit_errors.items()}
    provenance = {
        "seed": seed,
        "settings": files.plain(config.settings),
        "selected": f"best of seeds {seeds.first_seed} to {last}",
        "orbit_errors": files.plain(errors),
        "free_run": config.free_run,
        "teaching": files.plain(config.teaching),
        "practice": files.plain(config.practice),
        "versions": files.versions(),
    }
    return to_mjcf(draw_body(seed, config.settings), provenance=provenance)


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
    title = f"last {config.window:g} s of {config.free_run:g} s in closed loop"
    columns = ("task", "orbit error", "period error", "amplitude error", "training NRMSE")
    table = table_of(title, *columns)
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
    if result.seeds is not None:
        show_seeds(result, console)
    if result.steps_per_second is not None:
        console.print(
            f"{result.body!r}: {result.steps_per_second:,.0f} steps a second in closed loop, "
            f"{result.closed_loop_cost_ratio:.2f} x a bare mj_step loop"
        )


def show_seeds(result: Result, console: Console) -> None:
    """How many of the bodies learned it."""
    assert result.seeds is not None
    title = f"orbit error below {100 * result.config.threshold:g} %"
    columns = ("task", "bodies", "95 % interval", "median orbit error", "median period error")
    table = Table(*columns, title=title)
    rows: dict[str, Any] = result.seeds.metrics
    for name, row in rows.items():
        errors = [
            f"{100 * row[key]:.3f} %" if key in row else ""
            for key in ("median_orbit_error", "median_period_error")
        ]
        table.add_row(name, *rate_cells(row), *errors)
    console.print(table)
    console.print(f"best body: seed {result.seeds.best_seed}, written to best.xml")


EXPERIMENT = Experiment(
    name="limit_cycle",
    config=Config,
    run=run,
    show=show,
    bar=counting("teaching and running", total_steps),
    seed=lambda config: config.noise_seed,
    write=write,
    figures=figures,
    film=write_videos,
    clean_up=Result.remove_checkpoints,
    needs_folder=True,
    resumes=True,
)
