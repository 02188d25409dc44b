"""The command: search."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.search.figure import best_bodies_figure, score_figure, success_rate_figure
from mcmj.experiments.search.run import Config, Result, run, total_trials
from mcmj.mjcf.read import from_mjcf
from mcmj.pictures.plotting import save
from mcmj.search.database import TrialStore
from mcmj.search.export import write_csv, write_parquet
from mcmj.utils import files
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import trial_bar
from mcmj.utils.success_rates import rate_cells


def work(config: Config, output: Output, out: Path) -> None:
    path = config.store or out / "trials.sqlite"
    with trial_bar(
        "trials", total_trials(config), maximise=config.maximise, quiet=output.quiet
    ) as on_trial:
        result = run(config, store=path, on_trial=on_trial)
    write(result, out)
    with TrialStore(path, create=False) as kept:
        write_csv(kept, out / "trials.csv")
        with suppress(McmjError):  # pyarrow is an extra
            write_parquet(kept, out / "trials.parquet")
    if not output.quiet:
        show(result, out)


def write(result: Result, out: Path) -> None:
    config = result.config
    for place, xml in enumerate(result.bodies, start=1):
        files.write_text(out / (f"best_{place}.xml" if place > 1 else "best.xml"), xml)
    if result.by_setting:
        save(success_rate_figure(result.by_setting), out / "success_rate.png")
    figure = score_figure(
        groups(result), config.threshold, name=config.target.name, maximise=config.maximise
    )
    save(figure, out / "scores.png")
    if result.bodies:
        titles = [title(result, int(index)) for index in result.ranking]
        bodies = [from_mjcf(xml)[0] for xml in result.bodies]
        save(best_bodies_figure(list(zip(bodies, titles, strict=False))), out / "best_bodies.png")
    files.write_metrics(out / "metrics.json", "search", config, config.first_seed, result.metrics)


def groups(result: Result) -> dict[str, np.ndarray]:
    """Scores by what tells most: the settings if they are few, else the parts of the score."""
    if 1 < len(result.settings) <= 6:
        return {label(s): x for s, x in zip(result.settings, result.scores, strict=True)}
    if len(result.parts) > 1:
        parts = {result.config.target.label(path): x.ravel() for path, x in result.parts.items()}
        return {**parts, "the worst of them": result.scores.ravel()}
    return {"all trials": result.scores.ravel()}


def label(setting: dict[str, object]) -> str:
    return ", ".join(f"{path.rpartition('.')[2]} {short(value)}" for path, value in setting.items())


def short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def title(result: Result, index: int) -> str:
    row = result.describe(index)
    score = row["score"] if row["confirmed_score"] is None else row["confirmed_score"]
    where = label(result.settings[index // result.config.seeds])
    return f"seed {row['seed']}: {short(score)}" + (f" ({where})" if where else "")


def show(result: Result, out: Path) -> None:
    config, metrics, console = result.config, result.metrics, Console()
    side = "above" if config.maximise else "below"
    table = Table(title=f"{config.experiment}: {config.target.path} {side} {config.threshold:g}")
    for column in ("", "", "trials", "95 % interval"):
        table.add_column(column)
    parts = {path: config.target.label(path) for path in result.parts}
    rows = [("score", parts.get(path, path), row) for path, row in result.success.items()]
    for path, values in result.by_setting.items():
        rows += [(path, bounds(row), row) for row in values]
    for name, value, row in rows:
        table.add_row(name, value, *rate_cells(row))
    console.print(table)
    best = [title(result, int(index)) for index in result.ranking[: config.best]]
    if best:
        console.print("best: " + "; ".join(best))
    speed = metrics["trials_per_second"]
    console.print(
        f"{metrics['trials']} trials, {metrics['evaluated']} of them run now"
        + (f" at {speed:.1f} a second" if speed else "")
        + (f", {100 * result.overhead:.1f} % over the bare runs" if result.overhead else "")
    )
    if result.agreement is not None:
        console.print(
            f"confirmed in MuJoCo: {len(result.confirmations)} trials, the same verdict in "
            f"{100 * result.agreement:.1f} %"
        )
    console.print(f"results in {out}")


def bounds(row: dict[str, object]) -> str:
    if "low" in row:
        return f"{short(row['low'])} to {short(row['high'])}"
    return short(row["value"])


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("search", Config, work, arguments)
