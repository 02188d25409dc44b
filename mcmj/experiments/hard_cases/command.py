"""The command: hard_cases."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.hard_cases.figure import step_figure
from mcmj.experiments.hard_cases.run import LONGEST, STEPS, Config, Result, Row, run
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    total = len(config.cases) * len(config.integrators)
    with progress_bar("cases", total, quiet=output.quiet) as on_rows:
        result = run(config, on_rows=on_rows)
    save(step_figure(result.steps), out / "hard_cases.png")
    files.write_text(out / "hard_cases.csv", to_csv(result))
    files.write_metrics(out / "metrics.json", "hard_cases", config, config.seed, result.metrics)
    if not output.quiet:
        show(result, out)


def to_csv(result: Result) -> str:
    """One row a case and integrator, steps in ms; inf if none up to 1 s fails."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["case", "integrator", *(f"{name}_ms" for name in STEPS)])
    for row in result.rows:
        steps = [f"{1e3 * getattr(row, name):.5g}" for name in STEPS]
        writer.writerow([row.case, row.integrator, *steps])
    return text.getvalue()


def show(result: Result, out: Path) -> None:
    table = Table(
        title="largest stable step, ms: measured; predicted safe .. blow-up", show_lines=True
    )
    table.add_column("case")
    for integrator in result.config.integrators:
        table.add_column(integrator)
    rows = {(row.case, row.integrator): row for row in result.rows}
    for case in result.config.cases:
        table.add_row(case, *(cell(rows[case, name]) for name in result.config.integrators))
    console = Console()
    console.print(table)
    console.print(f"results in {out}")


def cell(row: Row) -> str:
    measured, _, safe, blow_up = (milliseconds(getattr(row, name)) for name in STEPS)
    return f"{measured}\n{safe} .. {blow_up}"


def milliseconds(step: float) -> str:
    """Two digits, without an exponent where a person would not write one."""
    ms = 1e3 * step
    return "any" if step > LONGEST else f"{ms:.0f}" if ms >= 10 else f"{ms:.2g}"


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("hard_cases", Config, work, arguments)
