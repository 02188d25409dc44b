"""The command: input_driven."""

from pathlib import Path

from rich.console import Console

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.input_driven.config import Config, total_steps
from mcmj.experiments.input_driven.figure import figures
from mcmj.experiments.input_driven.result import Result
from mcmj.experiments.input_driven.run import run
from mcmj.mjcf.write import to_mjcf
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """body.xml with all readouts, and the first body's runs."""
    config = result.config
    files.write_text(folder / "body.xml", body_file(result))
    arrays = {f"eps_{u:g}/outputs": held.outputs for u, held in result.first.held.items()}
    files.write_arrays(folder / "trajectory.npz", arrays, config, config.seed)


def body_file(result: Result) -> str:
    """MJCF of the first body: its readouts, and what each was taught with."""
    first, config, start = result.first, result.config, result.first.start
    lessons = dict(start.lessons)
    if first.practised is not None:
        lessons[config.readout_name] = files.plain(config)
    return to_mjcf(
        result.body,
        timestep=config.timestep,
        integrator=start.stepping.get("integrator", DEFAULT_INTEGRATOR),
        w_out=first.w_out,
        readouts=result.readouts,
        provenance={"body": start.source, "taught_inputs": start.taught, "lessons": lessons},
    )


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config, first = result.config, result.first
    title = f"last {config.window:g} s of {config.free_run:g} s at constant input"
    columns = ("input", "orbit error", "amplitude error", "frequency error")
    table = table_of(title, *columns, words=0)
    for u, held in first.held.items():
        errors = (held.orbit_error, held.amplitude_error, held.frequency_error)
        table.add_row(f"{u:g}", *(f"{100 * error:.2f} %" for error in errors))
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


EXPERIMENT = Experiment(
    name="input_driven",
    config=Config,
    run=run,
    show=show,
    bar=counting("teaching, running", total_steps),
    write=write,
    figures=figures,
)
