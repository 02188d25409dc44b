"""Tables of measured numbers: CSV with a header, NPY, NPZ; what is wrong is named by its place."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.files import csv_rows
from mcmj.utils.validation import Array

KINDS = "a .csv, .npy or .npz file"


@dataclass(frozen=True)
class Recording:
    """Samples of named columns.

    Attributes:
        names: (n,) of the columns.
        values: (K, n).
        times: (K,) [s], if the file has them.
    """

    names: tuple[str, ...]
    values: Array
    times: Array | None


def read_recording(path: str, argument: str) -> Recording:
    """Read a table of numbers.

    A first column named time or t is the time. Columns of .npy are named 0, 1, ..; those of .npz
    by their array, and their number if it has two axes.

    Args:
        argument: that the file was given as, for errors.

    Raises:
        InvalidArgumentError: no such file, or cells that are no finite numbers; names the first,
            by row and column.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".csv", ".npy", ".npz"):
        raise InvalidArgumentError(argument, KINDS, path)
    names, values = _csv(path, argument) if suffix == ".csv" else _arrays(path, argument)
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = bad[0]
        more = f", and {len(bad) - 1} more" if len(bad) > 1 else ""
        place = f"row {row + 1}, column {names[column]!r}"
        raise InvalidArgumentError(
            argument, f"finite numbers in {path}", f"{values[row, column]} in {place}{more}"
        )
    times = None
    if names[0].lower().split("[")[0].strip() in ("time", "times", "t"):
        times, names, values = values[:, 0], names[1:], values[:, 1:]
    if not names or not len(values):
        raise InvalidArgumentError(argument, f"columns and rows in {path}", values.shape)
    return Recording(names, np.ascontiguousarray(values), times)


def _csv(path: str, argument: str) -> tuple[tuple[str, ...], Array]:
    rows = csv_rows(path, argument, KINDS)
    if len(rows) < 2 or any(_is_number(cell) for cell in rows[0][1]):
        got = ",".join(rows[0][1])[:60] if rows else "nothing"
        raise InvalidArgumentError(argument, f"a header of names, then rows, in {path}", got)
    names = tuple(cell.strip() for cell in rows[0][1])
    values = np.empty((len(rows) - 1, len(names)))
    for k, (line, cells) in enumerate(rows[1:]):
        where = f"in {path}, row {k + 1} (line {line})"
        if len(cells) != len(names):
            raise InvalidArgumentError(argument, f"{len(names)} cells {where}", len(cells))
        try:
            values[k] = cells
        except ValueError:
            at = next(i for i, cell in enumerate(cells) if not _is_number(cell))
            wanted = f"a number {where}, column {names[at]!r}"
            raise InvalidArgumentError(argument, wanted, repr(cells[at])) from None
    return names, values


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _arrays(path: str, argument: str) -> tuple[tuple[str, ...], Array]:
    """All arrays of a .npz side by side, or the one of a .npy; nothing is unpickled."""
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            arrays = {"": loaded}
        else:
            with loaded:
                arrays = dict(loaded)
    except Exception as error:  # a damaged file can fail anywhere
        reason = getattr(error, "strerror", None) or error
        raise InvalidArgumentError(argument, KINDS, f"{path}: {reason}") from error
    for name, array in arrays.items():
        if array.dtype.kind not in "fiu" or array.ndim not in (1, 2):
            what = f"{name or 'an array'} of {array.dtype}, shape {array.shape}"
            wanted = f"arrays of real numbers with one or two axes in {path}"
            raise InvalidArgumentError(argument, wanted, what)
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) != 1:
        raise InvalidArgumentError(argument, f"arrays of one length in {path}", lengths)
    names = [each for name, array in arrays.items() for each in _columns(name, array)]
    return tuple(names), np.column_stack(list(arrays.values())).astype(np.float64)


def _columns(name: str, array: Array) -> list[str]:
    if array.ndim == 1:
        return [name or "0"]
    return [f"{name}_{i}" if name else str(i) for i in range(array.shape[1])]
