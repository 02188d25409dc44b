"""The command: gaits."""

from pathlib import Path

import numpy as np
from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of, write_body
from mcmj.experiments.gaits.config import Config, total_steps
from mcmj.experiments.gaits.figure import figures
from mcmj.experiments.gaits.result import Result
from mcmj.experiments.gaits.run import run
from mcmj.utils import files


def write(result: Result, out: Path) -> None:
    """body.xml with all readouts, and the first body's runs."""
    config, first = result.config, result.first
    write_body(result, first.source, out)
    arrays = {"timestep": np.array(config.timestep)}
    for name, gait in first.gaits.items():
        arrays[f"{name}/outputs"] = gait.free.outputs
        arrays[f"{name}/from_rest"] = gait.from_rest.outputs
    for (start, end), switch in first.switches.items():
        arrays[f"{start}_to_{end}/outputs"] = switch.outputs
    files.write_arrays(out / "trajectory.npz", arrays, config, config.source.first_seed)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config, first = result.config, result.first
    title = f"last {config.window:g} s of {config.free_run:g} s in closed loop"
    columns = ("orbit error", "period error", "phase lag error", "duty factor", "from rest after")
    table = table_of(title, "gait", *columns)
    for name, gait in first.gaits.items():
        errors = gait.free.errors
        table.add_row(
            name,
            f"{100 * errors['orbit_error']:.3f} %",
            f"{100 * errors['period_error']:.3f} %",
            f"{errors['phase_lag_error']:.4f}",
            " ".join(f"{duty:.3f}" for duty in gait.free.duty_factors),
            f"{gait.from_rest.time:.1f} s",
        )
    title = f"{config.after:g} s after a switch: orbit error (switching time)"
    switches = table_of(title, "from \\ to", *config.gaits)
    for start in config.gaits:
        cells = []
        for end in config.gaits:
            run = first.switches.get((start, end))
            error = "" if run is None else f"{100 * run.errors['orbit_error']:.3f} %"
            cells.append(error if run is None else f"{error} ({run.time:.1f} s)")
        switches.add_row(start, *cells)
    console.print(table)
    if first.switches:
        console.print(switches)
    if config.seeds > 1:
        labels = {"free_run": "run all gaits", "switch": "make all switches",
                  "from_rest": "start all gaits from rest", "all": "do all of it"}  # fmt: skip
        for kind, label in labels.items():
            good = sum(bool(one[kind]) for one in result.outcomes)
            console.print(f"{good} of {config.seeds} bodies {label}")


EXPERIMENT = Experiment(
    name="gaits",
    config=Config,
    run=run,
    show=show,
    bar=counting("teaching, switching", total_steps),
    seed=lambda config: config.source.first_seed,
    write=write,
    figures=figures,
)
