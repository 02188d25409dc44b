"""The command: walk."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.walk.config import Config, total_steps
from mcmj.experiments.walk.figure import footfalls, phase_responses, pushes, stride_periods
from mcmj.experiments.walk.run import Result, run, tour
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import progress_bar

SHOWN = 4.0  # seconds of footfalls in the figure


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("walking", total_steps(config), quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    files.write_metrics(out / "metrics.json", "walk", config, config.seed, result.metrics)
    draw(result, out)
    if output.video:
        film(result, out)
    if not output.quiet:
        show(result, out)


def draw(result: Result, out: Path) -> None:
    table: Any = files.plain(result.metrics)
    if result.walks:
        titles = {
            name: f"{name}: {table[name]['stride_period_s']:.2f} s, "
            + (f"{table[name]['speed_m_s']:.2f} m/s" if table[name]["speed_m_s"] else "falls")
            for name in result.walks
        }
        save(footfalls(result.walks, titles, shown=SHOWN), out / "footfalls.png")
    if "push" in table:
        counts = {name: table["push"][name]["survived"] for name in result.config.gaits}
        save(pushes(counts, result.config.seeds), out / "pushes.png")
    if "adapt" in table:
        save(stride_periods(table["adapt"]), out / "adapt.png")
    if "recover" in table:
        save(phase_responses(table["recover"], result.config.nudge), out / "recover.png")


def film(result: Result, out: Path) -> None:
    from mcmj.pictures.walk_video import Event, walk_video  # needs OpenGL, the rest does not

    walker, walk, events = tour(result.lesson)
    walk_video(out / "walk.mp4", walker.model, walk, [Event(*event) for event in events])


def show(result: Result, out: Path) -> None:
    console = Console()
    table: Any = files.plain(result.metrics)
    if result.walks:
        rows = Table(title=f"{result.config.walking:g} s of walking")
        names = ("gait", "distance", "speed", "cost of transport", "stride period", "falls")
        for name in names:
            rows.add_column(name, justify="left" if name == "gait" else "right")
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
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("walk", Config, work, arguments)
