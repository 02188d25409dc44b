"""The command: reproduce."""

import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.base import Experiment, counting
from mcmj.experiments.reproduce.page import KINDS, page
from mcmj.experiments.reproduce.run import Config, Result, run, total_runs
from mcmj.utils import files
from mcmj.utils.errors import McmjError

TITLE = "The role of feedback in morphological computation, reproduced"


def write(result: Result, folder: Path) -> None:
    """reproduction.html, which needs no other file."""
    config = result.config
    account = json.dumps({"config": files.plain(config), "versions": files.versions()})
    runs = {part.name: config.runs(part) for part in config.parts}
    pictures = {
        name: [path for run, _ in some for path in sorted((folder / run.name).glob("*"))
               if path.suffix in KINDS]
        for name, some in runs.items()
    }  # fmt: skip
    commands = {
        name: [" ".join(["mcmj", run.script, *options]) for run, options in some]
        for name, some in runs.items()
    }
    html = page(TITLE, config.parts, result.outcomes, pictures, commands, account, result.costs)
    files.write_text(folder / "reproduction.html", html)


def show(result: Result, console: Console) -> None:
    """All claims as a table."""
    table = Table("figure", "claim", "ours: median (range)", "successes", "holds")
    for name, some in result.outcomes.items():
        for outcome in some:
            count = f"{outcome.rate['successes']} of {outcome.rate['of']}"
            verdict = "[red]no" if outcome.verdict == "no" else outcome.verdict
            table.add_row(name, outcome.claim.text, outcome.ours, count, verdict)
    console.print(table)
    console.print("the page: reproduction.html")


def verdict(result: Result) -> None:
    """Raise what the commands that failed said."""
    if result.failures:
        raise McmjError("; ".join(result.failures))


EXPERIMENT = Experiment(
    name="reproduce",
    config=Config,
    run=run,
    show=show,
    bar=counting("commands", total_runs),
    seed=lambda config: 0,
    write=write,
    verdict=verdict,
    needs_folder=True,
    resumes=True,
)
