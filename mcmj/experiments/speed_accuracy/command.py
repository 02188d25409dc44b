"""The command: speed_accuracy."""

import csv
import io
from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.speed_accuracy.config import Config
from mcmj.experiments.speed_accuracy.figure import figures
from mcmj.experiments.speed_accuracy.result import Result
from mcmj.experiments.speed_accuracy.run import BASE, run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """All cells as a table."""
    files.write_text(folder / "speed_accuracy.csv", as_csv(result))


def as_csv(result: Result) -> str:
    """One row a body, method and step."""
    text = io.StringIO()
    table = csv.writer(text)
    horizons = [f"position_error_at_{t:g}_s" for t in result.config.horizons]
    costs = ["us_per_simulated_second", "cost_ratio_to_euler_1ms", "stable"]
    table.writerow(["body", "method", "step_ms", *horizons, "length_error", *costs])
    for body, methods in result.cells.items():
        for method, steps in methods.items():
            for step, cell in steps.items():
                numbers = (cell.length_error, cell.us_per_second, cell.cost_ratio, cell.stable)
                table.writerow([body, method, step, *cell.position_errors, *numbers])
    return text.getvalue()


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    console = Console(width=40 + 16 * len(result.cells))
    step = 1.0 if 1.0 in result.config.steps_ms else result.config.steps_ms[0]
    title = f"error at {step:g} ms (cost over {BASE})"
    table = table_of(title, "method", "order", *result.cells, words=2)
    for method in result.config.methods:
        order = result.orders[method]
        cells = [methods[method][step] for methods in result.cells.values()]
        table.add_row(
            method,
            f"{order.slope:.2f}" if order else "-",
            *(f"{c.error:.1e} ({c.cost_ratio:.2g})" if c.stable else "-" for c in cells),
        )
    console.print(table)
    console.print("orbit errors of readouts taught under A and run under B:")
    for task, errors in result.attractor.items():
        pairs = ", ".join(f"{name} {100 * error:.2f} %" for name, error in errors.items())
        console.print(f"  {task}: {pairs}")


EXPERIMENT = Experiment(
    name="speed_accuracy",
    config=Config,
    run=run,
    show=show,
    bar=counting("bodies", lambda config: len(config.bodies)),
    write=write,
    figures=figures,
)
