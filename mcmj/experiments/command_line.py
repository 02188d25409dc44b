"""The command `mcmj`: experiments by name, arguments, errors, exit status."""

import hashlib
import json
import re
import sys
import textwrap
import warnings
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

import mcmj
from mcmj.experiments.base import Experiment, Output, carry_out
from mcmj.experiments.registry import GROUPS, entries, experiment_named
from mcmj.utils.errors import McmjError, McmjWarning
from mcmj.utils.files import only_run, prepare_folder
from mcmj.utils.gl_backend import check_backend

LONGEST_NAME = 80  # of a folder
WIDTH = 80  # of help texts


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
    check_backend()
    config, output = parse(experiment, arguments)
    if experiment.page and output.out is not None and output.out.suffix == ".html":
        config = replace(config, page=output.out.name)
        output = replace(output, out=output.out.parent)
    folder = prepare_folder(output.out or default_folder(experiment, config))
    with only_run(folder):
        carry_out(experiment, config, replace(output, quiet=output.quiet or output.json), folder)
    if output.json:
        document = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
        print(json.dumps(document["metrics"], indent=2))


def parse(experiment: Experiment, arguments: Sequence[str]) -> tuple[Any, Output]:
    """The config and the output options that arguments ask for.

    Raises:
        SystemExit: they are wrong (said on stderr), or ask for help.
    """

    def both(
        config: Annotated[Any, tyro.conf.OmitArgPrefixes],
        output: Annotated[Output, tyro.conf.OmitArgPrefixes],
    ) -> tuple[Any, Output]:
        return config, output

    unnamed = tyro.conf.arg(name="")  # "config" is no word of the user's
    both.__annotations__["config"] = Annotated[
        experiment.config, tyro.conf.OmitArgPrefixes, unnamed
    ]
    return tyro.cli(
        both,
        prog=f"mcmj {experiment.name}",
        args=list(arguments),
        description=_wrapped(experiment.about),
    )


def _wrapped(text: str) -> str:
    """Paragraphs as lines of a help text; tyro keeps the breaks of lines that are indented."""
    paragraphs = (" ".join(one.split()) for one in text.split("\n\n"))
    wrap = textwrap.TextWrapper(WIDTH, initial_indent="  ", subsequent_indent="  ")
    return "\n".join(wrap.fill(one) for one in paragraphs)


def default_folder(experiment: Experiment, config: Any) -> Path:
    """results/<name>, and the options that are not the default, so that no command overwrites
    the results of another."""
    changes = changed_fields(experiment.config(), config)
    told = (
        f"{name}={'+'.join(map(str, value)) if isinstance(value, tuple) else value}"
        for name, value in changes.items()
    )
    text = "-".join([experiment.name, *told])
    plain = re.sub(r"[^\w.,=+-]+", "_", text)
    if len(plain) > LONGEST_NAME:
        plain = f"{plain[:LONGEST_NAME]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
    return Path("results") / plain


def changed_fields(default: Any, config: Any) -> dict[str, object]:
    """The fields of nested dataclasses that differ, by their own name."""
    found: dict[str, object] = {}
    for field in fields(config):
        one, other = getattr(default, field.name), getattr(config, field.name)
        if is_dataclass(other) and type(one) is type(other):
            found |= changed_fields(one, other)
        elif one != other:
            found[field.name] = other
    return found


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
