"""The command: input_driven."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.input_driven.config import Config, total_steps
from mcmj.experiments.input_driven.figure import input_curves_figure, jumps_figure
from mcmj.experiments.input_driven.run import Result, run
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("teaching, running", total_steps(config), quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    first = result.first
    files.write_text(out / "body.xml", body_file(result))
    save(curves(result), out / "input_curves.png")
    jumps = {u: first.held[u] for u in config.inputs}
    runs = {u: (h.target, h.outputs, h.orbit_error) for u, h in jumps.items()}
    save(jumps_figure(runs, config.timestep, config.course.last), out / "input_jumps.png")
    arrays = {f"eps_{u:g}/outputs": held.outputs for u, held in first.held.items()}
    files.write_arrays(out / "trajectory.npz", arrays, config, config.seed)
    files.write_metrics(out / "metrics.json", "input_driven", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def body_file(result: Result) -> str:
    """MJCF of the first body: its readouts, and what each was taught with."""
    first, config, start = result.first, result.config, result.first.start
    lessons = dict(start.lessons)
    if first.practised is not None:
        lessons[config.readout_name] = files.plain(config)
    return to_mjcf(
        result.body,
        timestep=config.timestep,
        w_out=first.w_out,
        readouts=result.readouts,
        provenance={"body": start.source, "taught_inputs": start.taught, "lessons": lessons},
    )


def curves(result: Result) -> Figure:
    """Fig. 10 from the first body's runs."""
    first = result.first
    inputs, runs = np.array(list(first.held)), list(first.held.values())
    target = np.array([(h.target_amplitude, 1.0 / h.target.period) for h in runs]).T
    held = np.array([(h.amplitude, h.frequency) for h in runs]).T
    branches = first.sweep.body if first.sweep else ()
    sweep = [(b.inputs, b.amplitudes, b.frequencies) for b in branches]
    return input_curves_figure((inputs, *target), (inputs, *held), sweep, first.start.taught)


def show(result: Result, out: Path) -> None:
    config, first = result.config, result.first
    table = Table(title=f"last {config.window:g} s of {config.free_run:g} s at constant input")
    for column in ("input", "orbit error", "amplitude error", "frequency error"):
        table.add_column(column, justify="right")
    for u, held in first.held.items():
        errors = (held.orbit_error, held.amplitude_error, held.frequency_error)
        table.add_row(f"{u:g}", *(f"{100 * error:.2f} %" for error in errors))
    console = Console()
    console.print(table)
    if first.sweep:
        found = first.sweep.differences(min(config.inputs))
        for name in ("amplitude", "frequency"):
            own, targets = (found[f"{whose}{name}_hysteresis"] for whose in ("", "target_"))
            console.print(
                f"sweep down and up, from {min(config.inputs):g} on: {name} differs by "
                f"{100 * own:.1f} % at most (target: {100 * targets:.1f} %)"
            )
    if config.seeds > 1:
        for name, row in result.rates.items():
            console.print(f"input {name}: {row['successes']} of {row['of']} bodies")
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("input_driven", Config, work, arguments)
