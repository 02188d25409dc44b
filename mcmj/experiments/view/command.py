"""The command: view."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.view.run import Config, run
from mcmj.utils import files


def work(config: Config, output: Output, out: Path) -> None:
    result = run(config)
    arrays = {"times": result.times, "outputs": result.outputs}
    files.write_arrays(out / "trajectory.npz", arrays, config, config.seed)
    files.write_metrics(out / "metrics.json", "view", config, config.seed, result.metrics)
    if not output.quiet:
        metrics = result.metrics
        Console().print(
            f"{metrics['frames']} frames, {metrics['frames_per_second']:.0f} a second, "
            f"{metrics['real_time_factor']:.2f} x real time; in {out}"
        )


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("view", Config, work, arguments)
