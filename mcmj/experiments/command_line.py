"""What every script does around its experiment: arguments, folder, errors, exit status."""

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypeVar

import tyro

from mcmj.utils.errors import McmjError, McmjWarning
from mcmj.utils.files import prepare_folder

C = TypeVar("C")


@dataclass(frozen=True)
class Output:
    """Where results go.

    Attributes:
        out: folder for metrics.json and the figures; default: results/<script>.
        quiet: no progress bars and no table.
        video: make videos.
        json: print the metrics as JSON instead of a table.
    """

    out: Path | None = None
    quiet: bool = False
    video: bool = True
    json: bool = False


def main(name: str, config_type: type[C], work: Callable[[C, Output, Path], None]) -> None:
    """Parse the command line into a config, run `work`, and turn errors into exit status 1.

    Args:
        name: the script's name.
        work: called with config, output options and the (existing, writable) folder.
    """

    def command(
        config: Annotated[config_type, tyro.conf.OmitArgPrefixes],  # type: ignore[valid-type]
        output: Annotated[Output, tyro.conf.OmitArgPrefixes],
    ) -> None:
        folder = prepare_folder(output.out or Path("results") / name)
        work(config, replace(output, quiet=output.quiet or output.json), folder)
        if output.json:
            document = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
            print(json.dumps(document["metrics"], indent=2))

    as_before = warnings.formatwarning
    warnings.formatwarning = _one_line(name, as_before)
    try:
        tyro.cli(command, prog=f"{name}.py")
    except McmjError as error:
        sys.exit(f"{name}: error: {error}")
    except KeyboardInterrupt:
        print(f"{name}: interrupted; nothing half-written is left", file=sys.stderr)
        sys.exit(130)
    finally:
        warnings.formatwarning = as_before


def _one_line(name: str, other: Callable[..., str]) -> Callable[..., str]:
    """How warnings are shown: ours as errors are, in one line."""

    def shown(
        message: Warning | str, category: type[Warning], *where: object, **line: object
    ) -> str:
        if issubclass(category, McmjWarning):
            return f"{name}: warning: {message}\n"
        return other(message, category, *where, **line)

    return shown
