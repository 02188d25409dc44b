"""Targets by what a user calls them: a known name, a CSV file, a name in Python."""

import functools
import importlib
import re
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np

from mcmj.core.rollout_arguments import Driven
from mcmj.targets.gaits import GAITS, gait_target
from mcmj.targets.limit_cycles import TARGETS, Target, from_array, target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.files import csv_rows
from mcmj.utils.validation import SHORTEST_STEP, Array

NAMES = (*TARGETS, *GAITS)
OWN = ("a path to a .csv file", "package.module:function")
FEWEST_ROWS, STEP_TOLERANCE = 4, 0.01


def named_target(task: str, *others: str) -> Target:
    """A target of mcmj, or of one's own.

    One's own is named by its file (without .csv) or function, with _ for whatever is not a
    letter, a digit, - or _.

    Args:
        task: one of NAMES; the path of a .csv file, see `read_curve`; or package.module:name of
            a Target or of a function() -> Target, which is called once a process.
        others: what else the caller takes, for the error.

    Raises:
        UnknownNameError: none of these.
        InvalidArgumentError: a file or a Python name that gives no target, or one that has fewer
            than 2 outputs, that does not move, or that is named as one of mcmj's.
    """
    if task in NAMES:
        return gait_target(task) if task in GAITS else target(task)
    if task.lower().endswith(".csv"):
        return _checked(read_curve(task), Path(task).stem, task)
    if ":" in task:
        return _checked(_from_python(task), re.split(r"[:.]", task)[-1], task)
    raise UnknownNameError("task", task, [*NAMES, *others, *OWN])


def named_targets(task: str) -> dict[str, Target]:
    """Targets by name: that of a task, or with "all" the three of the paper."""
    tasks = tuple(TARGETS) if task == "all" else (task,)
    return {one.name: one for one in (named_target(each, "all") for each in tasks)}


def require_outputs(body: Driven, wanted: Target, name: str = "body") -> None:
    """Raise InvalidArgumentError unless a body or reservoir has as many outputs as a target."""
    if not isinstance(wanted, Target):
        raise InvalidArgumentError(
            "target", "a Target, such as mcmj.target('van_der_pol')", repr(wanted)
        )
    if body.n_outputs != wanted.n_outputs:
        raise InvalidArgumentError(
            name, f"{wanted.n_outputs} feedback channels for {wanted.name}", body.n_outputs
        )


def read_curve(path: str | Path) -> Target:
    """A closed curve from a CSV file: one period, closed by a periodic cubic spline.

    A header; then rows of the time [s] and at least 2 outputs, in equal steps (to 1 %). One step
    after the last row comes the first one again, which is not repeated.

    Raises:
        InvalidArgumentError: the file cannot be read, or is not like that; names the line.
    """
    lines, table = _table(path)
    times, values = table[:, 0], table[:, 1:]
    with np.errstate(all="ignore"):  # numbers that overflow are refused
        steps = np.diff(times)
        step = float(np.median(steps))
        unequal = np.flatnonzero(~(np.abs(steps - step) <= STEP_TOLERANCE * step))
        if unequal.size or not step >= SHORTEST_STEP:
            row = int(unequal[0]) + 1 if unequal.size else 1
            raise _wrong(path, lines[row], f"a step of {step:g} s, > 0", f"{steps[row - 1]:g} s")
        if (values[-1] == values[0]).all() and (values[1] != values[0]).any():
            raise _wrong(path, lines[-1], "no first row again: a period ends before", "one")
        try:
            return from_array("curve", values, float((times[-1] - times[0]) / (len(times) - 1)))
        except ValueError as error:
            raise InvalidArgumentError("task", f"a smooth curve in {path}", error) from error


def _table(path: str | Path) -> tuple[list[int], Array]:
    """The rows of numbers (T, 1 + n_outputs), and their line numbers."""
    rows = csv_rows(path, "task", f"a CSV file, or one of {', '.join(NAMES)}")
    if len(rows) <= FEWEST_ROWS:
        rows_wanted = f"a header and at least {FEWEST_ROWS} rows in {path}"
        raise InvalidArgumentError("task", rows_wanted, f"{len(rows)} lines")
    first, header = rows[0]
    if len(header) < 3 or _numbers(header) is not None:
        raise _wrong(path, first, "a header, such as time,x1,x2", ",".join(header))
    table = []
    for line, cells in rows[1:]:
        row = _numbers(cells)
        if row is None or len(row) != len(header):
            raise _wrong(path, line, f"{len(header)} numbers", ",".join(cells))
        table.append(row)
    return [line for line, _ in rows[1:]], np.array(table)


def _numbers(cells: Sequence[str]) -> list[float] | None:
    """The cells as finite numbers, if they are."""
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _wrong(path: str | Path, line: int, expected: str, got: str) -> InvalidArgumentError:
    return InvalidArgumentError("task", f"{expected} in {path}, line {line}", got[:60])


@functools.cache
def _from_python(task: str) -> Target:
    """The Target that package.module:name is, or that it returns."""
    module, _, name = task.partition(":")
    try:
        found = attrgetter(name)(importlib.import_module(module))
        goal = found if isinstance(found, Target) else found()
    except Exception as error:  # anything: it is the user's code
        raise InvalidArgumentError(
            "task",
            f"package.module:function, or one of {', '.join(NAMES)}",
            f"{task}: {type(error).__name__}: {error}",
        ) from error
    if not isinstance(goal, Target):
        raise InvalidArgumentError("task", "a function that returns a Target", f"{task}: {goal!r}")
    return goal


def _checked(goal: Target, name: str, task: str) -> Target:
    """The target under a name that is safe in files."""
    safe = re.sub(r"[^\w-]+", "_", name)
    if safe in (*NAMES, "all"):
        raise InvalidArgumentError("task", f"another name than mcmj's {safe}", task)
    if goal.n_outputs < 2:
        raise InvalidArgumentError("task", "at least 2 outputs", f"{goal.n_outputs} in {task}")
    if not np.ptp(goal.orbit(64), axis=0).any():
        raise InvalidArgumentError("task", "a curve that moves", task)
    return replace(goal, name=safe)
