"""The command: reproduce."""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj.experiments.command_line import Output, main
from mcmj.experiments.reproduce.claims import Outcome, Part, Run, chosen, judge
from mcmj.experiments.reproduce.page import KINDS, page
from mcmj.experiments.reproduce.paper import PARTS
from mcmj.experiments.reproduce.runner import execute, finished, metrics_of, options_of
from mcmj.utils import files as store
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import progress_bar

SCRIPTS = Path(__file__).resolve().parent
TITLE = "The role of feedback in morphological computation, reproduced"


@dataclass(frozen=True)
class Config:
    """What to reproduce.

    Attributes:
        quick: fewer bodies, committed ones where there are, no long runs.
        only: parts, such as fig6; default: all. fig9 is in fig8, fig11 in fig10.
    """

    quick: bool = False
    only: tuple[str, ...] = ()


ALIASES = {"fig9": "fig8", "fig11": "fig10"}


def work(config: Config, output: Output, out: Path) -> None:
    parts = chosen(PARTS, [ALIASES.get(name, name) for name in config.only])
    runs = {part.name: runs_of(part, config) for part in parts}
    failures = execute_all([run for some in runs.values() for run in some], out, output)
    outcomes = {part.name: outcomes_of(part, runs[part.name], out) for part in parts}
    write(config, parts, runs, outcomes, out)
    if not output.quiet:
        show(outcomes, out)
    if failures:
        raise McmjError("; ".join(failures))


def runs_of(part: Part, config: Config) -> list[tuple[Run, tuple[str, ...]]]:
    """The runs of this mode, with their options."""
    pairs = [(run, options_of(run, quick=config.quick)) for run in part.runs]
    return [(run, options) for run, options in pairs if options is not None]


def execute_all(pairs: list[tuple[Run, tuple[str, ...]]], out: Path, output: Output) -> list[str]:
    """Run what is not finished; returns the messages of what failed."""
    failures = []
    with progress_bar("commands", len(pairs), quiet=output.quiet) as on_runs:
        for run, options in pairs:
            try:
                if not finished(run, options, out):
                    execute(run, options, out, SCRIPTS)
            except McmjError as error:
                failures.append(str(error))
            except KeyboardInterrupt:
                print("reproduce: the same command goes on with what is left", file=sys.stderr)
                raise
            on_runs(1)
    return failures


def outcomes_of(part: Part, runs: list[tuple[Run, tuple[str, ...]]], out: Path) -> list[Outcome]:
    found = {run.name: metrics_of(run, out) for run, options in runs if finished(run, options, out)}
    return [judge(claim, found[claim.run]) for claim in part.claims if claim.run in found]


def write(
    config: Config,
    parts: list[Part],
    runs: dict[str, list[tuple[Run, tuple[str, ...]]]],
    outcomes: dict[str, list[Outcome]],
    out: Path,
) -> None:
    """reproduction.html and metrics.json."""
    account = json.dumps({"config": store.plain(config), "versions": store.versions()})
    files = {
        name: [path for run, _ in some for path in sorted((out / run.name).glob("*"))
               if path.suffix in KINDS]
        for name, some in runs.items()
    }  # fmt: skip
    commands = {
        name: [" ".join(["sh scripts/run.sh", run.script, *options]) for run, options in some]
        for name, some in runs.items()
    }
    html = page(TITLE, parts, outcomes, files, commands, account)
    store.write_text(out / "reproduction.html", html)
    table = {name: [outcome.plain for outcome in some] for name, some in outcomes.items()}
    flat = [outcome.holds for some in outcomes.values() for outcome in some]
    metrics = {"held": sum(flat), "claims": len(flat), "parts": table}
    store.write_metrics(out / "metrics.json", "reproduce", config, 0, metrics)


def show(outcomes: dict[str, list[Outcome]], out: Path) -> None:
    table = Table("figure", "claim", "ours: median (range)", "successes", "holds")
    for name, some in outcomes.items():
        for outcome in some:
            count = f"{outcome.rate['successes']} of {outcome.rate['of']}"
            verdict = "yes" if outcome.holds else "[red]no"
            table.add_row(name, outcome.claim.text, outcome.ours, count, verdict)
    console = Console()
    console.print(table)
    console.print(f"results in {out}/reproduction.html")


def command(arguments: Sequence[str] | None = None) -> None:
    """Run it with the arguments of a command line."""
    main("reproduce", Config, work, arguments)
