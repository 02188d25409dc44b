"""The command: adopt."""

import warnings
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.experiments.adopt.config import Config, total_readouts
from mcmj.experiments.adopt.figure import figures, film_of
from mcmj.experiments.adopt.result import RUNS, Adopted, Result
from mcmj.experiments.adopt.run import run
from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.pictures.opengl import RenderingUnavailableError
from mcmj.pictures.rendering import Style, write_film
from mcmj.utils import files
from mcmj.utils.errors import McmjError, McmjWarning

SECONDS = 12.0  # of a film


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
        film = film_of(one)
        paths = {suffix: folder / f"{Path(name).stem}{suffix}" for suffix in (".mp4", ".png")}
        try:
            write_film(film, paths, Style(speed=float(film.times[-1]) / SECONDS), stills=1)
        except RenderingUnavailableError as error:
            warnings.warn(f"no film: {error}", McmjWarning, stacklevel=2)
            return


def show(result: Result, console: Console) -> None:
    """All models: what was learned, then what they are worth."""
    config = result.config
    percent, last = 100 * config.threshold, f"the last {config.window:g} s"
    title = f"of {config.seeds} readouts, those with an orbit error below {percent:g} % in {last}"
    columns = ("model", "free", "median", "worst", "from rest", "held", "kicked", "recovery")
    table = table_of(title, *columns)
    for name, one in result.adopted.items():
        free = 100 * one.errors("free")
        counts = [str(int((one.errors(run) < config.threshold).sum())) for run in RUNS]
        errors = [f"{np.median(free):.2f} %", f"{free.max():.2f} %"]
        recovery = f"{np.median(one.errors('recovery')):.1f} s"
        table.add_row(Path(name).stem, counts[0], *errors, *counts[1:], recovery)
    console.print(table)
    console.print(_models_table(result))


def _models_table(result: Result) -> Table:
    columns = ("period", "signals", "rank", "kernel", "memory", "total", "control")
    table = table_of("the models as reservoirs", "model", *columns)
    for name, one in result.adopted.items():
        worth = [""] * 4
        if one.worth is not None:
            found = one.worth.measures
            worth = [f"{one.worth.capacities.rank}", f"{found['kernel_rank']}"]
            worth += [f"{found[name]:.1f}" for name in ("memory_capacity", "ipc_total")]
        period, signals = f"{one.target.period:.2f} s", str(one.reservoir.n_signals)
        control = f"{one.largest_control:.2f}"
        table.add_row(Path(name).stem, period, signals, *worth, control)
    return table


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
