"""Runs the commands of a reproduction, each in a process and a folder of its own; resumable."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcmj.experiments.reproduce.claims import Command
from mcmj.utils import files
from mcmj.utils.errors import McmjError

ACCOUNT, COST = "account.json", "cost.json"
PROGRAM = (sys.executable, "-m", "mcmj")
Process = subprocess.Popen[str]


@dataclass(frozen=True)
class Cost:
    """What a command took.

    Attributes:
        seconds: by the clock.
        processor_seconds: on all cores; None where the system does not tell.
    """

    seconds: float
    processor_seconds: float | None


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
    run: Command,
    options: Sequence[str],
    folder: Path,
    program: Sequence[str] = PROGRAM,
    on_start: Callable[[Process], object] = lambda process: None,
) -> None:
    """Run a command into folder/<name>; what was there before is removed.

    Args:
        program: what carries out experiments, before their name and options.
        on_start: called with the process.

    Raises:
        McmjError: it failed: with its own message.
    """
    out, begin = folder / run.name, time.perf_counter()
    shutil.rmtree(out, ignore_errors=True)
    command = [*program, run.script, *options, "--quiet", "--out", str(out)]
    status, told, processor = _wait(command, on_start)
    if status:
        asked = " ".join([run.script, *options])
        raise McmjError(f"{asked} failed: {told.strip() or f'status {status}'}")
    cost = files.plain(Cost(time.perf_counter() - begin, processor))
    files.write_text(out / COST, json.dumps(cost))
    files.write_text(out / ACCOUNT, _account(run, options))


def _wait(
    command: Sequence[str], on_start: Callable[[Process], object]
) -> tuple[int, str, float | None]:
    """Exit status, what it said on stderr, and processor time [s] of a command."""
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        on_start(process)
        assert process.stderr is not None
        told = process.stderr.read()
        if not hasattr(os, "wait4"):  # not a Unix
            return process.wait(), told, None
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, told, usage.ru_utime + usage.ru_stime


def metrics_of(run: Command, folder: Path) -> dict[str, Any]:
    """The metrics that a finished run wrote."""
    document = json.loads((folder / run.name / "metrics.json").read_text(encoding="utf-8"))
    found: dict[str, Any] = document["metrics"]
    return found


def cost_of(run: Command, folder: Path) -> Cost | None:
    """What a finished run took; None if it was not kept."""
    try:
        return Cost(**json.loads((folder / run.name / COST).read_text(encoding="utf-8")))
    except OSError:
        return None


def _account(run: Command, options: Sequence[str]) -> str:
    return json.dumps({"script": run.script, "options": options, "versions": files.versions()})
