"""The command: design."""

from pathlib import Path

import numpy as np
from rich.console import Console

from mcmj.experiments.base import Experiment, table_of
from mcmj.experiments.design.config import Config
from mcmj.experiments.design.figure import figures
from mcmj.experiments.design.result import KINDS, Designs, Result
from mcmj.experiments.design.run import OnBody, run, total_bodies
from mcmj.utils import files
from mcmj.utils.progress import trial_bar


def resume(config: Config, folder: Path, on_steps: OnBody) -> Result:
    """The designs; their store is in the folder, if the config names none."""
    return run(config, store=folder / "trials.sqlite", on_body=on_steps)


def write(result: Result, folder: Path) -> None:
    """The best designed body, and the smallest, each with its readout."""
    for name, xml in result.champions.items():
        files.write_text(folder / f"{name}.xml", xml)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config = result.config
    columns = ("task", "nodes", *KINDS.values(), "bodies tried at random", "for designs")
    rows = [
        (task, nodes, found)
        for task, sizes in result.smallest.items()
        for nodes, found in sorted(sizes.items())
    ]
    if result.bodies is not None:
        rows.append((config.task, config.settings.nodes, result.bodies))
    title = f"bodies below {100 * config.threshold:g} % under unseen noise"
    table = table_of(title, *columns)
    for task, nodes, found in rows:
        table.add_row(task, str(nodes), *_cells(found))
    if rows:
        console.print(table)
    if result.predictors is not None:
        areas = result.predictors.held_out
        table = table_of("what tells beforehand", "measure before teaching", "area, held out")
        for name, area in sorted(areas.items(), key=lambda item: -item[1]):
            table.add_row(name.replace("_", " "), f"{area:.2f}")
        console.print(table)
    if result.fronts is not None:
        title = f"noise of {config.sensor_noise:g} m on all lengths"
        table = table_of(title, "bodies", "median of the least error", "successes")
        for kind in ("random", "designed"):
            errors = result.fronts.least(kind)
            good = f"{(errors < config.threshold).sum()} of {len(errors)}"
            table.add_row(kind, f"{100 * np.median(errors):.2g} %", good)
        console.print(table)


def _cells(found: Designs) -> list[str]:
    counts = [f"{found.successes(kind)} of {len(found.bodies)}" for kind in KINDS]
    tried = [found.search_evaluations, found.evaluations]
    return [*counts, *(f"{np.median(x):.0f} ({min(x)} to {max(x)})" for x in tried)]


EXPERIMENT = Experiment(
    name="design",
    config=Config,
    run=resume,
    show=show,
    bar=lambda config, quiet: trial_bar("bodies", total_bodies(config), quiet=quiet),
    write=write,
    figures=figures,
    needs_folder=True,
    resumes=True,
)
