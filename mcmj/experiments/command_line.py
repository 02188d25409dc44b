"""The command `mcmj`: experiments by name, arguments, errors, exit status."""

import json
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

import mcmj
from mcmj.experiments.base import Experiment, Output, carry_out
from mcmj.experiments.registry import GROUPS, entries, experiment_named
from mcmj.utils.errors import McmjError, McmjWarning
from mcmj.utils.files import prepare_folder


def main(arguments: Sequence[str]) -> None:
    """Run `mcmj` with these arguments; what fails ends with a message and exit status 1."""
    name, rest = (arguments[0], arguments[1:]) if arguments else ("--help", ())
    if name in ("-h", "--help", "help"):
        overview()
    elif name == "--version":
        print(f"mcmj {mcmj.__version__}")
    else:
        with _errors_in_one_line(name):
            command(experiment_named(name), rest)


def overview() -> None:
    """All experiments, a line each, by group."""
    console = Console()
    console.print("usage: mcmj EXPERIMENT [options]      mcmj EXPERIMENT --help", markup=False)
    table = Table.grid(padding=(0, 2))
    for group in GROUPS:
        table.add_row("")
        table.add_row(f"[bold]{group}")
        for name, entry in entries().items():
            if entry.group == group:
                table.add_row(f"  {name}", entry.line)
    console.print(table)


def command(experiment: Experiment, arguments: Sequence[str]) -> None:
    """Parse the options of an experiment, and carry it out."""

    def work(
        config: Annotated[Any, tyro.conf.OmitArgPrefixes],
        output: Annotated[Output, tyro.conf.OmitArgPrefixes],
    ) -> None:
        folder = prepare_folder(output.out or Path("results") / experiment.name)
        carry_out(experiment, config, replace(output, quiet=output.quiet or output.json), folder)
        if output.json:
            document = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
            print(json.dumps(document["metrics"], indent=2))

    work.__annotations__["config"] = Annotated[experiment.config, tyro.conf.OmitArgPrefixes]
    about = sys.modules[experiment.run.__module__.rpartition(".")[0]].__doc__ or ""
    tyro.cli(work, prog=f"mcmj {experiment.name}", args=list(arguments), description=about)


class _errors_in_one_line:  # noqa: N801  (used as a context manager)
    """Our errors as one line and status 1, our warnings as one line, an interrupt as 130."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        self.as_before = warnings.formatwarning
        warnings.formatwarning = _one_line(self.name, self.as_before)

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        warnings.formatwarning = self.as_before
        if isinstance(error, McmjError):
            sys.exit(f"{self.name}: error: {error}")
        if isinstance(error, KeyboardInterrupt):
            print(f"{self.name}: interrupted; nothing half-written is left", file=sys.stderr)
            sys.exit(130)


def _one_line(name: str, other: Callable[..., str]) -> Callable[..., str]:
    """How warnings are shown: ours as errors are, in one line."""

    def shown(
        message: Warning | str, category: type[Warning], *where: object, **line: object
    ) -> str:
        if issubclass(category, McmjWarning):
            return f"{name}: warning: {message}\n"
        return other(message, category, *where, **line)

    return shown
