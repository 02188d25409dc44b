"""The command: certify."""

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.certify.config import Config
from mcmj.experiments.certify.figure import figures
from mcmj.experiments.certify.result import Result, in_words
from mcmj.experiments.certify.run import STAGES, run
from mcmj.utils.progress import progress_bar


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table = Table("", "", title=f"certificate: {result.target.name}")
    for name, value in in_words(result):
        table.add_row(name, value)
    console.print(table)


EXPERIMENT = Experiment(
    name="certify",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar("certifying", len(STAGES), quiet=quiet),
    seed=lambda config: config.noise_seed,
    figures=figures,
)
