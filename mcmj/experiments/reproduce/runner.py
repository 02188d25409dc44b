"""Runs the commands of a reproduction, each in a process and a folder of its own; resumable."""

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mcmj.experiments.reproduce.claims import Command
from mcmj.utils import files
from mcmj.utils.errors import McmjError

ACCOUNT = "account.json"
PROGRAM = (sys.executable, "-m", "mcmj")


def options_of(run: Command, *, quick: bool) -> tuple[str, ...] | None:
    """Its options in that mode; None if it is not run."""
    return run.quick if quick else run.full


def finished(run: Command, options: Sequence[str], folder: Path) -> bool:
    """Whether this very command, with these versions, has been run there to the end."""
    try:
        return (folder / run.name / ACCOUNT).read_text(encoding="utf-8") == _account(run, options)
    except OSError:
        return False


def execute(
    run: Command, options: Sequence[str], folder: Path, program: Sequence[str] = PROGRAM
) -> None:
    """Run a command into folder/<name>; what was there before is removed.

    Args:
        program: what carries out experiments, before their name and options.

    Raises:
        McmjError: it failed: with its own message.
    """
    out = folder / run.name
    shutil.rmtree(out, ignore_errors=True)
    command = [*program, run.script, *options, "--quiet"]
    done = subprocess.run([*command, "--out", str(out)], stderr=subprocess.PIPE, text=True)
    if done.returncode:
        told = " ".join([run.script, *options])
        raise McmjError(f"{told} failed: {done.stderr.strip() or f'status {done.returncode}'}")
    files.write_text(out / ACCOUNT, _account(run, options))


def metrics_of(run: Command, folder: Path) -> dict[str, Any]:
    """The metrics that a finished run wrote."""
    document = json.loads((folder / run.name / "metrics.json").read_text(encoding="utf-8"))
    found: dict[str, Any] = document["metrics"]
    return found


def _account(run: Command, options: Sequence[str]) -> str:
    return json.dumps({"script": run.script, "options": options, "versions": files.versions()})
