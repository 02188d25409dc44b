"""The command: fit."""

import csv
import io
from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.fit.config import Config
from mcmj.experiments.fit.figure import figures
from mcmj.experiments.fit.result import Result
from mcmj.experiments.fit.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """readout.csv: a row a signal, the bias last, a column a target."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["signal", *result.target_names])
    names = [*result.signal_names, *(["bias"] if result.config.bias else [])]
    for name, row in zip(names, result.fit.w_out.tolist(), strict=True):
        table.writerow([name, *row])
    files.write_text(folder / "readout.csv", text.getvalue())


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table = table_of("held-out NRMSE (std)", "target", "readout")
    for name, error in result.errors.items():
        table.add_row(name, f"{error:.4g}")
    fit, metrics = result.fit, result.metrics
    if len(result.errors) > 1:
        table.add_row("all together", f"{metrics['test_nrmse_std']:.4g}")
    console.print(table)
    console.print(
        f"{fit.rows} rows to train, {len(result.wanted)} to test; {len(result.signal_names)} "
        f"signals of rank {result.rank}, condition number {fit.condition_number:.3g}"
    )
    if result.worth is not None:
        console.print(
            f"without the body, from the inputs and their delays: "
            f"{metrics['baseline_test_nrmse_std']:.4g}; memory capacity "
            f"{metrics['memory_capacity']:.2f}, information processing capacity "
            f"{metrics['information_processing_capacity']:.2f} of {metrics['ipc_bound']} at most"
        )


EXPERIMENT = Experiment(
    name="fit",
    config=Config,
    run=run,
    show=show,
    bar=counting("fitting", lambda config: 1),
    seed=lambda config: 0,
    write=write,
    figures=figures,
)
