"""The command: trunk."""

from pathlib import Path
from typing import Any

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.trunk.config import Config, total_steps
from mcmj.experiments.trunk.figure import figures
from mcmj.experiments.trunk.result import Result
from mcmj.experiments.trunk.run import run
from mcmj.robots.trunk_walker import walk
from mcmj.utils import files

SHOWN = 5.0  # seconds of each gait in the film


def write(result: Result, folder: Path) -> None:
    """The readouts that were learned."""
    arrays = {
        f"{name}/w_out": gait.learned.w_out
        for name, gait in result.gaits.items()
        if gait.learned is not None
    }
    files.write_arrays(folder / "readouts.npz", arrays, result.config, result.config.seed)


def film(result: Result, out: Path) -> None:
    """The gaits one after another."""
    from mcmj.pictures.trunk_video import trunk_video  # needs OpenGL, the rest does not

    gaits = {name: gait for name, gait in result.gaits.items() if gait.learned is not None}
    walks = {name: walk(gait.robot(), gait.trunk, SHOWN) for name, gait in gaits.items()}
    first = next(iter(gaits.values()))
    trunk_video(out / "trunk.mp4", first.robot().model, first.trunk, walks)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table: Any = files.plain(result.metrics)
    title = f"{result.config.walking:g} s of walking, springs drive the muscles"
    columns = ("speed", "cost of transport", "orbit error", "by regression", "falls")
    rows = table_of(title, "gait", *columns)
    for name in result.config.gaits:
        row = table[name]
        walked = ["-"] * 3 if row["falls"] else [
            f"{row['speed_m_s']:.2f} m/s", f"{row['cost_of_transport']:.1f}",
            f"{row['orbit_error']:.1%}",
        ]  # fmt: skip
        regression = table.get("regression", {}).get(name)
        plain = "" if regression is None else error_text(regression["orbit_error"])
        rows.add_row(name, *walked, plain, str(row["falls"]))
    console.print(rows)
    for name, row in table.get("seeds", {}).items():
        upright, taught = row["upright"], row["taught"]
        console.print(
            f"{name}: {upright['successes']} of {upright['of']} robots walk without a fall, "
            f"{taught['successes']} in the gait that was taught"
        )


def error_text(error: float | None) -> str:
    """An orbit error, or that the robot fell."""
    return "falls" if error is None else f"{error:.0%}"


EXPERIMENT = Experiment(
    name="trunk",
    config=Config,
    run=run,
    show=show,
    bar=counting("walking", total_steps),
    write=write,
    figures=figures,
    film=film,
)
