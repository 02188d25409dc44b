"""The command: search."""

from contextlib import suppress
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment
from mcmj.experiments.search.config import Config
from mcmj.experiments.search.figure import figures
from mcmj.experiments.search.result import Result, short
from mcmj.experiments.search.run import OnTrial, run, total_trials
from mcmj.metrics.success_rates import rate_cells
from mcmj.search.database import TrialStore
from mcmj.search.export import write_csv, write_parquet
from mcmj.utils import files
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import trial_bar


def resume(config: Config, folder: Path, on_steps: OnTrial) -> Result:
    """The search; its store is in the folder, if the config names none."""
    return run(config, store=store_path(config, folder), on_trial=on_steps)


def store_path(config: Config, folder: Path) -> Path:
    """Where the trials are kept."""
    return config.store or folder / "trials.sqlite"


def write(result: Result, folder: Path) -> None:
    """The best bodies, and all trials as tables."""
    for place, xml in enumerate(result.bodies, start=1):
        files.write_text(folder / (f"best_{place}.xml" if place > 1 else "best.xml"), xml)
    with TrialStore(store_path(result.config, folder), create=False) as kept:
        write_csv(kept, folder / "trials.csv")
        with suppress(McmjError):  # pyarrow is an extra
            write_parquet(kept, folder / "trials.parquet")


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    config, metrics, console = result.config, result.metrics, Console()
    side = "above" if config.maximise else "below"
    heading = f"{config.experiment}: {config.target.path} {side} {config.threshold:g}"
    table = Table("", "", "trials", "95 % interval", title=heading)
    parts = {path: config.target.label(path) for path in result.parts}
    rows = [("score", parts.get(path, path), row) for path, row in result.success.items()]
    for path, values in result.by_setting.items():
        rows += [(path, bounds(row), row) for row in values]
    for name, value, row in rows:
        table.add_row(name, value, *rate_cells(row))
    console.print(table)
    best = [result.title(int(index)) for index in result.ranking[: config.best]]
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


def bounds(row: dict[str, object]) -> str:
    """The value of a setting, or the range of its bin."""
    if "low" in row:
        return f"{short(row['low'])} to {short(row['high'])}"
    return short(row["value"])


EXPERIMENT = Experiment(
    name="search",
    config=Config,
    run=resume,
    show=show,
    bar=lambda config, quiet: trial_bar(
        "trials", total_trials(config), maximise=config.maximise, quiet=quiet
    ),
    seed=lambda config: config.first_seed,
    write=write,
    figures=figures,
    needs_folder=True,
    resumes=True,
)
