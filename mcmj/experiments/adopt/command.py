"""The command: adopt."""

from pathlib import Path

import numpy as np
from rich.console import Console

from mcmj.experiments.adopt.config import Config, total_readouts
from mcmj.experiments.adopt.figure import figures
from mcmj.experiments.adopt.result import RUNS, Adopted, Result
from mcmj.experiments.adopt.run import run
from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.pictures.model_film import ModelFilm, write_model_film
from mcmj.utils import files
from mcmj.utils.errors import McmjError


def write(result: Result, folder: Path) -> None:
    """A file for every model with its first readout, and the ends of the free runs."""
    arrays = {}
    for name, one in _that_moved(result).items():
        files.write_text(folder / f"{Path(name).stem}.xml", one.reservoir.to_mjcf())
        for field in ("times", "qpos", "outputs"):
            arrays[f"{Path(name).stem}/{field}"] = getattr(one.motion, field)
    files.write_arrays(folder / "free_runs.npz", arrays, result.config, result.config.seed)


def write_films(result: Result, folder: Path) -> None:
    """An MP4 for every model, and its last picture as PNG."""
    for name, one in _that_moved(result).items():
        assert one.motion is not None
        film = ModelFilm(
            one.reservoir.model, one.motion.times, one.motion.qpos, one.motion.outputs,
            one.target.orbit(1000),
        )  # fmt: skip
        write_model_film(film, folder / f"{Path(name).stem}.mp4")


def show(result: Result, console: Console) -> None:
    """The table of all models."""
    config = result.config
    title = (
        f"orbit error below {100 * config.threshold:g} % in the last {config.window:g} s, of "
        f"{config.seeds} readouts"
    )
    table = table_of(
        title, "model", "target", "period", "signals", "free", "from rest", "held", "kicked",
        "median error", "worst", "recovery", "largest control", "memory", "nonlinear", "kernel",
        words=2,
    )  # fmt: skip
    for name, one in result.adopted.items():
        free = 100 * one.errors("free")
        successes = [str(int((one.errors(run) < config.threshold).sum())) for run in RUNS]
        table.add_row(
            Path(name).stem, one.target.name, f"{one.target.period:.2f} s",
            str(one.reservoir.n_signals), *successes, f"{np.median(free):.2f} %",
            f"{free.max():.2f} %", f"{np.median(one.errors('recovery')):.1f} s",
            f"{one.largest_control:.2f}", *_worth_cells(one),
        )  # fmt: skip
    console.print(table)


def _worth_cells(one: Adopted) -> list[str]:
    worth = one.worth
    if worth is None:
        return [""] * 3
    return [f"{worth.memory:.1f}", f"{worth.nonlinear:.1f}", str(worth.kernel_rank)]


def _that_moved(result: Result) -> dict[str, Adopted]:
    return {name: one for name, one in result.adopted.items() if one.motion is not None}


def _verdict(result: Result) -> None:
    """Raise if a model has no readout at all."""
    lost = [name for name, one in result.adopted.items() if one.motion is None]
    if lost:
        raise McmjError(f"blew up with every readout: {', '.join(lost)}")


EXPERIMENT = Experiment(
    name="adopt",
    config=Config,
    run=run,
    show=show,
    bar=counting("readouts", total_readouts),
    write=write,
    figures=figures,
    film=write_films,
    verdict=_verdict,
)
