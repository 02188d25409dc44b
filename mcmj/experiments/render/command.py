"""The command: render."""

import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.render.run import Config, run
from mcmj.learning.lessons import Teaching
from mcmj.pictures.rendering import write_film
from mcmj.utils import files
from mcmj.utils.progress import progress_bar

NAME = "film"


def work(config: Config, output: Output, out: Path) -> None:
    longest = config.before + config.during + config.after + Teaching().total
    with progress_bar("running", round(1e3 * longest), quiet=output.quiet) as on_steps:
        film = run(config, on_steps=on_steps)
    paths = {f".{kind}": out / f"{NAME}.{kind}" for kind in config.formats}
    frames = len(film.pick(config.style.fps, config.style.speed))
    with progress_bar("drawing", frames, quiet=output.quiet) as on_frames:
        report = write_film(film, paths, config.style, stills=config.stills, on_frames=on_frames)
    if report.why_flat:
        print(f"render: drawn by matplotlib: {report.why_flat}", file=sys.stderr)
    metrics = {
        **report.metrics,
        "deformation": film.scale,
        "largest_force": film.largest_force,
        "largest_strain": film.largest_strain,
        "pace": config.style.pace,
        "duration": float(film.times[-1] - film.times[0]),
    }
    files.write_metrics(out / "metrics.json", "render", config, config.seed, metrics)
    if not output.quiet:
        Console().print(
            f"{report.metrics['frames']} frames by {report.backend}, median "
            f"{report.metrics['body_frame_ms']:.1f} ms a picture of the body (640x480), "
            f"{report.metrics['whole_frame_ms']:.1f} ms a frame; deformation x {film.scale:g}, "
            f"{config.style.pace}; in {out}"
        )


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("render", Config, work, arguments)
