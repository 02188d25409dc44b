"""The command: view."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment
from mcmj.experiments.view.run import Config, Result, run
from mcmj.utils import files
from mcmj.utils.progress import OnSteps, progress_bar


def look(config: Config, on_steps: OnSteps) -> Result:
    """The session; a person ends it, so that nothing says how far it is."""
    return run(config)


def write(result: Result, folder: Path) -> None:
    """What was seen."""
    arrays = {"times": result.times, "outputs": result.outputs}
    files.write_arrays(folder / "trajectory.npz", arrays, result.config, result.config.seed)


def show(result: Result, console: Console) -> None:
    """How smoothly it ran."""
    metrics = result.metrics
    console.print(
        f"{metrics['frames']} frames, {metrics['frames_per_second']:.0f} a second, "
        f"{metrics['real_time_factor']:.2f} x real time"
    )


EXPERIMENT = Experiment(
    name="view",
    config=Config,
    run=look,
    show=show,
    bar=lambda config, quiet: progress_bar("", 0, quiet=True),
    write=write,
)
