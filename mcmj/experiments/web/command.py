"""The command: web."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment
from mcmj.experiments.web.config import Config
from mcmj.experiments.web.run import Result, run
from mcmj.utils import files
from mcmj.utils.progress import OnSteps, progress_bar


def make(config: Config, on_steps: OnSteps) -> Result:
    """The page; it takes seconds, so that nothing says how far it is."""
    return run(config)


def write(result: Result, folder: Path) -> None:
    """The page."""
    files.write_text(folder / result.config.page, result.html)


def show(result: Result, console: Console) -> None:
    """What to do with it."""
    megabytes = len(result.html.encode()) / 1e6
    console.print(
        f"{result.config.page}: {megabytes:.2f} MB, {result.scene.options.integrator}, "
        f"readouts {', '.join(readout.name for readout in result.scene.readouts)}; "
        "open it with a double click"
    )


EXPERIMENT = Experiment(
    name="web",
    config=Config,
    run=make,
    show=show,
    bar=lambda config, quiet: progress_bar("", 0, quiet=True),
    write=write,
    page=True,
)
