"""The command: render."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.render.config import Config, total_milliseconds
from mcmj.experiments.render.run import run
from mcmj.pictures.film import Film
from mcmj.pictures.rendering import Report, write_film
from mcmj.utils.progress import OnSteps

NAME = "film"


@dataclass(frozen=True)
class Rendered:
    """A film, and how its pictures were made."""

    config: Config
    film: Film
    report: Report

    @property
    def metrics(self) -> Mapping[str, object]:
        """Of the film and of its drawing."""
        return {
            **self.report.metrics,
            "deformation": self.film.scale,
            "largest_force": self.film.largest_force,
            "largest_strain": self.film.largest_strain,
            "pace": self.config.style.pace,
            "duration": float(self.film.times[-1] - self.film.times[0]),
        }


def render(config: Config, folder: Path, on_steps: OnSteps) -> Rendered:
    """Run, then draw; progress is counted in milliseconds run and in milliseconds drawn."""
    film = run(config, on_steps=on_steps)
    paths = {f".{kind}": folder / f"{NAME}.{kind}" for kind in config.formats}
    frame = round(1e3 * config.style.speed / config.style.fps)
    report = write_film(
        film, paths, config.style, stills=config.stills, on_frames=lambda _: on_steps(frame)
    )
    if report.why_flat:
        print(f"render: drawn by matplotlib: {report.why_flat}", file=sys.stderr)
    return Rendered(config, film, report)


def show(result: Rendered, console: Console) -> None:
    """How the film was drawn."""
    metrics = result.report.metrics
    console.print(
        f"{metrics['frames']} frames by {result.report.backend}, median "
        f"{metrics['body_frame_ms']:.1f} ms a picture of the body (640x480), "
        f"{metrics['whole_frame_ms']:.1f} ms a frame; deformation x {result.film.scale:g}, "
        f"{result.config.style.pace}"
    )


EXPERIMENT = Experiment(
    name="render",
    config=Config,
    run=render,
    show=show,
    bar=counting("running and drawing", total_milliseconds),
    needs_folder=True,
)
