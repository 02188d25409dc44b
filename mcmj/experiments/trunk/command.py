"""The command: trunk."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.trunk.config import Config, total_seconds
from mcmj.experiments.trunk.figure import trunk_figure
from mcmj.experiments.trunk.run import Result, run
from mcmj.pictures.plotting import save
from mcmj.robots.trunk_walker import TIMESTEP
from mcmj.utils import files
from mcmj.utils.progress import progress_bar

SHOWN = 5.0  # seconds of each gait in the film


def work(config: Config, output: Output, out: Path) -> None:
    total = round(total_seconds(config) / TIMESTEP)
    with progress_bar("walking", total, quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    files.write_metrics(out / "metrics.json", "trunk", config, config.seed, result.metrics)
    arrays = {
        f"{name}/w_out": gait.learned.w_out
        for name, gait in result.gaits.items()
        if gait.learned is not None
    }
    files.write_arrays(out / "readouts.npz", arrays, config, config.seed)
    walks = {
        name: (gait.target, gait.walk)
        for name, gait in result.gaits.items()
        if gait.walk is not None
    }
    if walks:
        trunk = next(iter(result.gaits.values())).trunk
        save(trunk_figure(trunk, walks), out / "trunk.png")
        if output.video:
            film(result, out)
    if not output.quiet:
        show(result, out)


def film(result: Result, out: Path) -> None:
    from mcmj.pictures.trunk_video import trunk_video  # needs OpenGL, the rest does not

    walkers = {
        name: gait.walker() for name, gait in result.gaits.items() if gait.learned is not None
    }
    trunk_video(out / "trunk.mp4", walkers, shown=SHOWN)


def show(result: Result, out: Path) -> None:
    console = Console()
    table: Any = files.plain(result.metrics)
    rows = Table(title=f"{result.config.walking:g} s of walking, springs drive the muscles")
    for name in ("gait", "speed", "cost of transport", "orbit error", "by regression", "falls"):
        rows.add_column(name, justify="left" if name == "gait" else "right")
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
    console.print(f"results in {out}")


def error_text(error: float | None) -> str:
    return "falls" if error is None else f"{error:.0%}"


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("trunk", Config, work, arguments)
