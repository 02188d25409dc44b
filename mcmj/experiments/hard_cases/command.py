"""The command: hard_cases."""

import csv
import io
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.hard_cases.config import Config
from mcmj.experiments.hard_cases.figure import figures
from mcmj.experiments.hard_cases.result import STEPS, Result, Row
from mcmj.experiments.hard_cases.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """All steps as a table."""
    files.write_text(folder / "hard_cases.csv", to_csv(result))


def to_csv(result: Result) -> str:
    """One row a case and integrator, steps in ms; inf if none fails that resolves the motion."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["case", "integrator", *(f"{name}_ms" for name in STEPS)])
    for row in result.rows:
        steps = [f"{1e3 * getattr(row, name):.5g}" for name in STEPS]
        writer.writerow([row.case, row.integrator, *steps])
    return text.getvalue()


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    title = "largest stable step, ms: measured; predicted bracket"
    table = Table("case", *result.config.integrators, title=title, show_lines=True)
    rows = {(row.case, row.integrator): row for row in result.rows}
    for case in result.config.cases:
        table.add_row(case, *(cell(rows[case, name]) for name in result.config.integrators))
    console.print(table)


def cell(row: Row) -> str:
    """Measured, and the predicted bracket [ms]; "any" that resolves the motion."""
    names = ("measured", "low", "high")
    measured, low, high = (milliseconds(getattr(row, name), row.resolved) for name in names)
    return f"{measured}\n{low}" if low == high == "any" else f"{measured}\n{low} .. {high}"


def milliseconds(step: float, longest: float) -> str:
    """Two digits, without an exponent where a person would not write one."""
    ms = 1e3 * step
    return "any" if step >= longest else f"{ms:.0f}" if ms >= 10 else f"{ms:.2g}"


EXPERIMENT = Experiment(
    name="hard_cases",
    config=Config,
    run=run,
    show=show,
    bar=counting("cases", lambda config: len(config.cases) * len(config.integrators)),
    write=write,
    figures=figures,
)
