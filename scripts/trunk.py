"""A robot that is its own computer: a trunk of springs on four legs of muscle learns to walk.

With no arguments: one robot, four gaits, all parts. --seeds 20 --parts: twenty robots, no parts.
"""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj import store
from mcmj.cli import Output, main
from mcmj.experiments.trunk import Result, run
from mcmj.experiments.trunk_config import Config, total_seconds
from mcmj.plotting import save
from mcmj.progress import progress_bar
from mcmj.trunk_walker import TIMESTEP
from mcmj.trunkplot import trunk_figure

SHOWN = 5.0  # seconds of each gait in the film


def work(config: Config, output: Output, out: Path) -> None:
    total = round(total_seconds(config) / TIMESTEP)
    with progress_bar("walking", total, quiet=output.quiet) as on_steps:
        result = run(config, on_steps=on_steps)
    store.write_metrics(out / "metrics.json", "trunk", config, config.seed, result.metrics)
    arrays = {
        f"{name}/w_out": gait.learned.w_out
        for name, gait in result.gaits.items()
        if gait.learned is not None
    }
    store.write_arrays(out / "readouts.npz", arrays, config, config.seed)
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
    from mcmj.trunkvideo import trunk_video  # needs OpenGL, the rest does not

    walkers = {
        name: gait.walker() for name, gait in result.gaits.items() if gait.learned is not None
    }
    trunk_video(out / "trunk.mp4", walkers, shown=SHOWN)


def show(result: Result, out: Path) -> None:
    console = Console()
    table: Any = store.plain(result.metrics)
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


if __name__ == "__main__":
    main("trunk", Config, work)
