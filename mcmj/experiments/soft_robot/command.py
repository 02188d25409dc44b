"""The command: soft_robot."""

from pathlib import Path
from typing import Any

from rich.console import Console

from mcmj.experiments.base import Experiment, counting, table_of
from mcmj.experiments.soft_robot.config import Config, total_steps
from mcmj.experiments.soft_robot.figure import figures
from mcmj.experiments.soft_robot.result import Result
from mcmj.experiments.soft_robot.run import run
from mcmj.experiments.trunk.command import SHOWN, error_text
from mcmj.experiments.trunk.result import LearnedGait
from mcmj.robots.trunk_walker import heading_ahead, walk
from mcmj.robots.walk_metrics import Walk
from mcmj.utils import files


def write(result: Result, folder: Path) -> None:
    """The readouts that were learned."""
    learned = {name: gait.learned for name, gait in result.gaits.items()}
    learned |= {f"steer/{name}": robot.learned for name, robot in result.steered.items()}
    arrays = {f"{name}/w_out": one.w_out for name, one in learned.items() if one is not None}
    files.write_arrays(folder / "readouts.npz", arrays, result.config, result.config.seed)


def film(result: Result, out: Path) -> None:
    """The gaits one after another, then the figure of eight."""
    from mcmj.pictures.trunk_video import trunk_video  # needs OpenGL, the rest does not

    gaits = {name: gait for name, gait in result.gaits.items() if gait.learned is not None}
    if gaits:
        walks = {name: _from_the_start(gait) for name, gait in gaits.items()}
        first = next(iter(gaits.values()))
        trunk_video(out / "soft_robot.mp4", first.robot().model, first.trunk, walks)
    for name, robot in result.steered.items():
        if robot.path is not None:
            walks = {f"{name}: a figure of eight": robot.path.walk}
            trunk_video(
                out / "soft_robot_eight.mp4", robot.robot().model, robot.trunk, walks, speed=4.0
            )


def _from_the_start(gait: LearnedGait) -> Walk:
    """Seen from the side, wherever it has learned to walk."""
    robot = gait.robot()
    robot.set_state(*heading_ahead(gait.trunk, robot))
    return walk(robot, gait.trunk, SHOWN)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table: Any = files.plain(result.metrics)
    title = f"{result.config.walking:g} s of walking, medians of {result.config.seeds} robots"
    columns = ("upright", "speed", "orbit error", "cost of transport", "of work given", "turning")
    rows = table_of(title, "gait", *columns)
    for name in result.config.gaits:
        row = table[name]
        walked = ["-"] * 5 if not row["upright"] else [
            f"{row['speed_m_s']:.2f} m/s", error_text(row["orbit_error"]),
            f"{row['cost_of_transport']:.2f}", f"{row['positive_cost']:.2f}",
            f"{row['turn_deg_s']:.1f} deg/s",
        ]  # fmt: skip
        rows.add_row(name, f"{row['upright']} of {row['of']}", *walked)
    console.print(rows)
    if "switch" in table:
        ends = [row["upright"] for row in table["switch"].values()]
        console.print(f"{sum(ends)} of {len(ends)} switches while walking")
    if "push" in table:
        most = ", ".join(f"{n} {v:g} N s" for n, v in table["push"]["by_gait_Ns"].items())
        console.print(f"pushes from the side, all survived: {most}")
    for steer in ("steer", "brake"):
        row = table.get(steer)
        if row is not None and not row["falls"]:
            name = "turns_deg_s" if steer == "steer" else "speeds_m_s"
            console.print(f"{name} {[round(v, 2) for v in row[name]]} at u = {row['told']}")


EXPERIMENT = Experiment(
    name="soft_robot",
    config=Config,
    run=run,
    show=show,
    bar=counting("walking", total_steps),
    write=write,
    figures=figures,
    film=film,
)
