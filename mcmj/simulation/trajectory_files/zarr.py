"""Trajectories as xarray Datasets and Zarr folders: named axes with units, written in chunks.

Needs the extra "files" (xarray, zarr). Axes: time [s], spring, node, axis (x, y, z), output,
and copy for copies; of a model that is no body, its joints and sensors.
`xarray.open_zarr(path)` reads a long run lazily.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.core.trajectory import RECORDABLE, Trajectory
from mcmj.simulation.trajectory_files.checks import checked_trajectory, reading
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
    "qpos": ("time", "qpos"),
    "qvel": ("time", "qvel"),
    "sensordata": ("time", "sensordata"),
}
# not a coordinate of strings: Zarr has no stable format for those
_NOTES = {2: {"axis": "x, y"}, 3: {"axis": "x, y, z"}}
_UNITS = {"lengths": "m", "outputs": "1", "positions": "m", "velocities": "m/s"}  # of a body


def to_dataset(trajectory: Trajectory, signals: Sequence[str] | None = None) -> xarray.Dataset:
    """A Dataset with named, unit-bearing axes; an ensemble has the axis "copy" too.

    One array of it as a pandas DataFrame, a column a signal: `.lengths.to_pandas()`.

    Args:
        signals: labels of the axis "spring", such as `Reservoir.signal_names`; Zarr has no stable
            format for them, so files have none.

    Raises:
        InvalidArgumentError: more or fewer labels than signals.
    """
    variables = {}
    for name in RECORDABLE:
        array = getattr(trajectory, name)
        if array is not None:
            axes = _AXES[name] if array.ndim == len(_AXES[name]) else ("copy", *_AXES[name])
            note = _NOTES[array.shape[-1]] if "axis" in axes else {}
            variables[name] = (axes, array, {"units": _UNITS.get(name, "")} | note)
    time = ("time", trajectory.times, {"units": "s", "long_name": "time at the start of the step"})
    dataset = xarray.Dataset(variables, coords={"time": time})
    if signals is None:
        return dataset
    if len(signals) != dataset.sizes.get("spring"):
        wanted = f"{dataset.sizes.get('spring', 'recorded lengths,')} names"
        raise InvalidArgumentError("signals", wanted, len(signals))
    return dataset.assign_coords(spring=list(signals))


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
    with reading("dataset", "a trajectory"):
        return checked_trajectory(np.ascontiguousarray(dataset["time"].values), recorded)


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
    origin = {"provenance": json.dumps(account)} | ({} if body is None else {"body": body})

    def dataset(part: Trajectory) -> xarray.Dataset:
        return to_dataset(part).assign_attrs(origin)  # every part: appending replaces them

    with whole_file(path, folder=True) as temporary:
        dataset(first).to_zarr(temporary, mode="w", consolidated=False, zarr_format=3)
        for part in parts:
            dataset(part).to_zarr(temporary, append_dim="time", consolidated=False)


def read_zarr(path: Path) -> tuple[Trajectory, str | None, dict[str, object]]:
    """The trajectory, the body as MJCF if there is one, and the account.

    Raises:
        TrajectoryFileError: not a Zarr folder of a whole trajectory.
    """
    with reading(path, "a trajectory in Zarr"):
        _check_whole(path)
        with xarray.open_zarr(path, consolidated=False, zarr_format=3) as dataset:
            trajectory = from_dataset(dataset)
            account = json.loads(dataset.attrs.get("provenance", "{}"))
            return trajectory, dataset.attrs.get("body"), account


def _check_whole(path: Path) -> None:
    """Zarr shows its fill value where a chunk is missing, and reads what a link leads to.

    Raises:
        TrajectoryFileError: a chunk is missing, an array holds no numbers, or a file is a link.
    """
    files = list(path.rglob("*"))
    links = [file.name for file in files if file.is_symlink()]
    if links:
        raise TrajectoryFileError(f"{path}: {links[0]} is a link to another file")
    for name, array in zarr.open_group(path, mode="r", zarr_format=3).arrays():
        # the number of files first: a shape in a damaged file can mean 1e12 chunks to look for
        if array.nchunks > len(files) or array.nchunks_initialized < array.nchunks:
            raise TrajectoryFileError(f"{path}: chunks of {name!r} are missing")
