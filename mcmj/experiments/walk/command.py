"""The command: walk."""

from pathlib import Path
from typing import Any

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.walk.config import Config, total_steps
from mcmj.experiments.walk.figure import figures
from mcmj.experiments.walk.run import Result, run, tour
from mcmj.utils import files


def film(result: Result, out: Path) -> None:
    """A tour: gaits, switches, a push."""
    from mcmj.pictures.walk_video import Event, walk_video  # needs OpenGL, the rest does not

    walker, walk, events = tour(result.lesson)
    walk_video(out / "walk.mp4", walker.model, walk, [Event(*event) for event in events])


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table: Any = files.plain(result.metrics)
    if result.walks:
        title = f"{result.config.walking:g} s of walking"
        columns = ("distance", "speed", "cost of transport", "stride period", "falls")
        rows = table_of(title, "gait", *columns)
        for name in result.walks:
            row = table[name]
            walked = ["-"] * 3 if row["falls"] else [
                f"{row['distance_m']:.1f} m", f"{row['speed_m_s']:.2f} m/s",
                f"{row['cost_of_transport']:.2f}",
            ]  # fmt: skip
            period = row["stride_period_s"]
            rows.add_row(name, *walked, f"{period:.3f} s" if period else "-", str(row["falls"]))
        console.print(rows)
    if "switch" in table:
        falls = sum(row["falls"] for row in table["switch"].values())
        total = len(table["switch"]) * result.config.moments
        console.print(f"{falls} falls in {total} switches while walking")
    if "push" in table:
        for name in result.config.gaits:
            counts = table["push"][name]["survived"]
            text = ", ".join(f"{count} at {impulse} N s" for impulse, count in counts.items())
            console.print(f"{name}: of {result.config.seeds} pushes survived {text}")
    if "cost" in table:
        console.print(f"a step costs {table['cost']['ratio']:.2f} times the planar body's alone")


EXPERIMENT = Experiment(
    name="walk",
    config=Config,
    run=run,
    show=show,
    bar=counting("walking", total_steps),
    figures=figures,
    film=film,
)
