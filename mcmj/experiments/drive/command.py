"""The command: drive."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.drive.figure import drive_figure
from mcmj.experiments.drive.run import Config, Episode, run, total_episodes
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("learning", total_episodes(config), quiet=output.quiet) as on_episodes:
        result = run(config, on_episodes=on_episodes)
    before, after = (
        (e.times, e.inputs, e.outputs, e.mean_reward) for e in (result.before, result.after)
    )
    save(drive_figure(result.target, result.rewards, before, after), out / "drive.png")
    episodes = {"before": result.before, "after": result.after}
    arrays = {
        f"{name}/{field}": getattr(episode, field)
        for name, episode in episodes.items()
        for field in Episode.__dataclass_fields__
    }
    files.write_arrays(out / "episodes.npz", arrays, config, config.seed)
    files.write_metrics(out / "metrics.json", "drive", config, config.seed, result.metrics)
    if not output.quiet:
        metrics = result.metrics
        Console().print(
            f"mean reward {metrics['mean_reward_without_input']:.3f} without input, "
            f"{metrics['mean_reward_learned']:.3f} after {metrics['episodes']} episodes; "
            f"orbit error of the last period {100 * result.errors[0]:.1f} % and "
            f"{100 * result.errors[1]:.1f} %; in {out}"
        )


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("drive", Config, work, arguments)
