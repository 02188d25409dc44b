"""Trajectories as xarray Datasets and Zarr folders: named axes with units, written in chunks.

Needs the extra "files" (xarray, zarr). Axes: time [s], spring, node, axis (x, then y), output,
and copy for an ensemble. `xarray.open_zarr(path)` reads a long run lazily.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.core.trajectory import RECORDABLE, Trajectory
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError
from mcmj.utils.extras import extra
from mcmj.utils.files import whole_file

with extra("files", "Zarr needs xarray and zarr"):
    import xarray
    import zarr

_AXES = {
    "lengths": ("time", "spring"),
    "outputs": ("time", "output"),
    "positions": ("time", "node", "axis"),
    "velocities": ("time", "node", "axis"),
}
# not a coordinate of strings: Zarr has no stable format for those
_NOTES = {"positions": {"axis": "x, y"}, "velocities": {"axis": "x, y"}}
_UNITS = {"lengths": "m", "outputs": "1", "positions": "m", "velocities": "m/s"}


def to_dataset(trajectory: Trajectory) -> xarray.Dataset:
    """A Dataset with named, unit-bearing axes; an ensemble has the axis "copy" too."""
    variables = {}
    for name in RECORDABLE:
        array = getattr(trajectory, name)
        if array is not None:
            axes = _AXES[name] if array.ndim == len(_AXES[name]) else ("copy", *_AXES[name])
            variables[name] = (axes, array, {"units": _UNITS[name]} | _NOTES.get(name, {}))
    time = ("time", trajectory.times, {"units": "s", "long_name": "time at the start of the step"})
    return xarray.Dataset(variables, coords={"time": time})


def from_dataset(dataset: xarray.Dataset) -> Trajectory:
    """The trajectory of `to_dataset`, in memory.

    Raises:
        TrajectoryFileError: not such a Dataset.
    """
    if "time" not in dataset.coords:
        raise TrajectoryFileError(f"expected a coordinate 'time', got {list(dataset.coords)}")
    recorded: dict[str, Any] = {}
    for name in RECORDABLE:
        if name in dataset:
            axes = _AXES[name]
            lead = ("copy",) if "copy" in dataset[name].dims else ()
            recorded[name] = np.ascontiguousarray(dataset[name].transpose(*lead, *axes).values)
    return Trajectory(np.ascontiguousarray(dataset["time"].values), **recorded)


def write_zarr(
    path: Path, parts: Iterator[Trajectory], body: str | None, account: dict[str, object]
) -> None:
    """Write consecutive chunks one by one, whole or not at all; see save_trajectory.

    Raises:
        InvalidArgumentError: no chunk.
        OutputError: the folder cannot be written.
    """
    first = next(parts, None)
    if first is None:
        raise InvalidArgumentError("run", "at least one chunk", "none")
    dataset = to_dataset(first)
    dataset.attrs["provenance"] = json.dumps(account)
    if body is not None:
        dataset.attrs["body"] = body
    with whole_file(path, folder=True) as temporary:
        dataset.to_zarr(temporary, mode="w", consolidated=False, zarr_format=3)
        for part in parts:
            to_dataset(part).to_zarr(temporary, append_dim="time", consolidated=False)


def read_zarr(path: Path) -> tuple[Trajectory, str | None, dict[str, object]]:
    """The trajectory, the body as MJCF if there is one, and the account.

    Raises:
        TrajectoryFileError: not a Zarr folder of a trajectory.
    """
    try:
        with xarray.open_zarr(path, consolidated=False) as dataset:
            trajectory = from_dataset(dataset)
            account = json.loads(dataset.attrs.get("provenance", "{}"))
            return trajectory, dataset.attrs.get("body"), account
    except (OSError, ValueError, KeyError) as error:
        if isinstance(error, TrajectoryFileError):
            raise
        raise TrajectoryFileError(f"{path}: not a trajectory in Zarr ({error})") from error
