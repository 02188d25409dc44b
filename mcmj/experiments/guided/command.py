"""The command: guided."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.guided.run import Config, Result, run
from mcmj.experiments.search.figure import guided_figure
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import trial_bar
from mcmj.utils.success_rates import rate_cells


def work(config: Config, output: Output, out: Path) -> None:
    with trial_bar(
        "settings", config.settings, maximise=config.large_is_good, quiet=output.quiet
    ) as on_setting:
        result = run(config, folder=out, on_setting=on_setting)
    figure = guided_figure(
        [objective for _, objective in result.tried],
        result.judged,
        config.threshold,
        names=(config.objective, config.target.name),
        maximise=(config.large_is_good, config.maximise),
    )
    save(figure, out / "guided.png")
    files.write_metrics(out / "metrics.json", "guided", config, config.first_seed, result.metrics)
    if not output.quiet:
        show(result, out)


def show(result: Result, out: Path) -> None:
    console = Console()
    metrics: dict[str, Any] = result.metrics
    table = Table(title=f"{result.config.judged} bodies that the search has not seen")
    for column in ("settings", "successes", "95 % interval", "median score", "objective"):
        table.add_column(column)
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
    console.print(f"results in {out}")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("guided", Config, work, arguments)
