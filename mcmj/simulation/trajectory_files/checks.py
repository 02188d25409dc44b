"""What every reader of trajectory files asks of a file that may be damaged or another's."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import RECORDABLE, TIME_AXIS, Trajectory
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError
from mcmj.utils.validation import Array, as_array


@contextmanager
def reading(path: str | Path, kind: str) -> Iterator[None]:
    """Whatever goes wrong inside the block is one clear error, of one line.

    Args:
        kind: what the file should be, as in "an NPZ file".

    Raises:
        TrajectoryFileError: anything went wrong.
    """
    try:
        yield
    except TrajectoryFileError:
        raise
    except Exception as error:  # readers raise anything on a damaged file
        reason = (str(error).splitlines() or [""])[0] or type(error).__name__
        raise TrajectoryFileError(f"{path}: not {kind} ({reason})") from error


def checked_trajectory(times: object, recorded: Mapping[str, object]) -> Trajectory:
    """A trajectory of finite numbers that fit each other.

    Args:
        times: (T,) [s].
        recorded: arrays by the names that a Trajectory has for them.

    Raises:
        InvalidArgumentError: not numbers, not finite, or of shapes that do not fit.
    """
    instants = _numbers("times", times, (None,))
    arrays: dict[str, Any] = {}
    copies = set()
    for name in RECORDABLE:
        if name in recorded:
            axes = -TIME_AXIS[name]  # without that of an ensemble's copies
            lead = (None,) if np.asarray(recorded[name]).ndim > axes else ()
            dimensions = 3 if np.asarray(recorded[name]).shape[-1:] == (3,) else 2
            rest = (None,) if axes == 2 else (None, dimensions)
            arrays[name] = _numbers(name, recorded[name], (*lead, len(instants), *rest))
            copies.add(arrays[name].shape[:-axes])
    if len(copies) > 1:
        raise InvalidArgumentError("copies", "the same number in every array", sorted(copies))
    return Trajectory(instants, **arrays)


def check_body_fits(trajectory: Trajectory, body: Body) -> None:
    """Raise unless the arrays can be a run of the body.

    Raises:
        InvalidArgumentError: another number of springs, outputs or nodes.
    """
    for name, axis, count in (
        ("lengths", -1, body.n_springs),
        ("outputs", -1, body.n_outputs),
        ("positions", -2, body.n_nodes),
        ("velocities", -2, body.n_nodes),
    ):
        array = getattr(trajectory, name)
        if array is not None and array.shape[axis] != count:
            raise InvalidArgumentError(name, f"{count} columns, as {body!r}", array.shape[axis])


def _numbers(name: str, value: object, shape: tuple[int | None, ...]) -> Array:
    dtype = np.asarray(value).dtype
    if dtype.kind not in "fiu":  # NumPy would convert text, too
        raise InvalidArgumentError(name, "numbers", f"type {dtype}")
    return as_array(name, value, shape)
