"""The command: certify."""

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.certify.config import Config
from mcmj.experiments.certify.figure import figures
from mcmj.experiments.certify.result import Result, in_words
from mcmj.experiments.certify.run import STAGES, run


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
    bar=counting("certifying", lambda config: len(STAGES)),
    seed=lambda config: config.noise_seed,
    figures=figures,
)
