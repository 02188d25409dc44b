"""The command: drive."""

from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.drive.config import Config, total_episodes
from mcmj.experiments.drive.figure import figures
from mcmj.experiments.drive.result import Episode, Result
from mcmj.experiments.drive.run import run
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """Both episodes."""
    episodes = {"before": result.before, "after": result.after}
    arrays = {
        f"{name}/{field}": getattr(episode, field)
        for name, episode in episodes.items()
        for field in Episode.__dataclass_fields__
    }
    files.write_arrays(folder / "episodes.npz", arrays, result.config, result.config.seed)


def show(result: Result, console: Console) -> None:
    """What was learned, in a sentence."""
    metrics = result.metrics
    console.print(
        f"mean reward {metrics['mean_reward_without_input']:.3f} without input, "
        f"{metrics['mean_reward_learned']:.3f} after {metrics['episodes']} episodes; "
        f"orbit error of the last period {100 * result.errors[0]:.1f} % and "
        f"{100 * result.errors[1]:.1f} %"
    )


EXPERIMENT = Experiment(
    name="drive",
    config=Config,
    run=run,
    show=show,
    bar=counting("learning", total_episodes),
    write=write,
    figures=figures,
)
