"""The command: guided."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.guided.config import Config
from mcmj.experiments.guided.figure import figures
from mcmj.experiments.guided.result import Result
from mcmj.experiments.guided.run import OnSetting, run
from mcmj.metrics.success_rates import rate_cells
from mcmj.utils.progress import trial_bar


def resume(config: Config, folder: Path, on_steps: OnSetting) -> Result:
    """The search, its store in the folder."""
    return run(config, folder=folder, on_setting=on_steps)


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    metrics: dict[str, Any] = result.metrics
    title = f"{result.config.judged} bodies that the search has not seen"
    columns = ("settings", "successes", "95 % interval", "median score", "objective")
    table = Table(*columns, title=title)
    for name in result.judged:
        row = metrics[name.replace("-", "_") + "_on_other_bodies"]
        median, objective = f"{row['median_score']:.3g}", f"{row['objective']:.3f}"
        table.add_row(name, *rate_cells(row), median, objective)
    console.print(table)
    console.print(f"guided: {result.best}")
    console.print(f"hand-chosen: {metrics['hand_chosen']}")
    if result.confirmed.size:
        console.print(
            f"guided, in MuJoCo: {metrics['confirmed']} bodies, the same verdict in "
            f"{100 * metrics['twin_mujoco_agreement']:.1f} %"
        )


EXPERIMENT = Experiment(
    name="guided",
    config=Config,
    run=resume,
    show=show,
    bar=lambda config, quiet: trial_bar(
        "settings", config.settings, maximise=config.large_is_good, quiet=quiet
    ),
    seed=lambda config: config.first_seed,
    figures=figures,
    needs_folder=True,
    resumes=True,
)
