"""Trajectories as OpenPRC's simulation.h5, so that its readouts and analyses run on our bodies.

Needs the extra "files" (h5py). Schema of OpenPRC 0.1 (its README, section 3.1.6), float32:

    attributes  total_frames, frame_rate [1/s], dt [s]
    time_series/time (T,)   nodes/positions, nodes/velocities (T, N, 3), z = 0 of planar bodies
    elements/bars/strain (T, L): l / l0 - 1

Bodies are not exchanged: OpenPRC's bars are linear, and its geometry.h5 has no place for cubic
stiffness and damping.
"""

import math
from pathlib import Path

import numpy as np

from mcmj.core.body import Body, spring_lengths
from mcmj.core.trajectory import Trajectory
from mcmj.simulation.trajectory_files.checks import checked_trajectory, reading
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError
from mcmj.utils.extras import extra
from mcmj.utils.files import whole_file
from mcmj.utils.validation import Array, as_array

with extra("files", "OpenPRC's files need h5py"):
    import h5py

_TIME = "time_series/time"
_POSITIONS, _VELOCITIES = "time_series/nodes/positions", "time_series/nodes/velocities"


def save_openprc(path: str | Path, trajectory: Trajectory, body: Body) -> None:
    """Write a run with recorded positions (and velocities, if recorded) as simulation.h5.

    Raises:
        InvalidArgumentError: positions not recorded, or more than one run.
        OutputError: the file cannot be written.
    """
    positions = trajectory.positions
    if positions is None or positions.ndim != 3 or len(trajectory) < 2:
        raise InvalidArgumentError("trajectory", "positions (T, N, D) of one run, T >= 2", "none")
    step = float(trajectory.times[1] - trajectory.times[0])
    strain = spring_lengths(positions, body.springs) / body.rest_lengths - 1.0
    arrays = {
        _TIME: trajectory.times,
        _POSITIONS: _with_z(positions),
        "time_series/elements/bars/strain": strain,
    }
    if trajectory.velocities is not None:
        arrays[_VELOCITIES] = _with_z(trajectory.velocities)
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update({"total_frames": len(trajectory), "frame_rate": 1.0 / step, "dt": step})
        for name, array in arrays.items():
            file.create_dataset(name, data=array.astype(np.float32))


def load_openprc(path: str | Path) -> Trajectory:
    """Read the times, positions and velocities of a simulation.h5.

    They are (T, N, 2) of nodes that never leave the plane z = 0, else (T, N, 3).

    Raises:
        TrajectoryFileError: no such file, damaged, not OpenPRC's, or one that leads to other files.
    """
    if not Path(path).is_file():  # a pipe would be waited for
        raise TrajectoryFileError(f"no such trajectory file: {path}")
    with reading(path, "a trajectory in HDF5"):
        with h5py.File(path, "r") as file:
            times, positions, velocities = (
                _read(file, name) for name in (_TIME, _POSITIONS, _VELOCITIES)
            )
        if times is None or positions is None:
            raise TrajectoryFileError(f"{path}: expected {_TIME} and {_POSITIONS} in it")
        recorded = {"positions": positions}
        if velocities is not None:
            recorded["velocities"] = velocities
        arrays = [as_array("nodes", array, (None, None, 3)) for array in recorded.values()]
        if not any(array[..., 2].any() for array in arrays):
            recorded = {name: np.ascontiguousarray(a[..., :2]) for name, a in recorded.items()}
        return checked_trajectory(times, recorded)


def _read(file: h5py.File, name: str) -> Array | None:
    """A dataset that lies in this file, whole; None if there is none of this name.

    Raises:
        TrajectoryFileError: it lies in another file, holds no numbers, or parts are missing.
    """
    place = file
    for part in name.split("/"):
        link = place.get(part, getlink=True)
        if link is None:
            return None
        if not isinstance(link, h5py.HardLink):
            raise TrajectoryFileError(f"{file.filename}: {name} is a link, maybe to another file")
        place = place[part]
    if place.is_virtual or place.external:
        raise TrajectoryFileError(f"{file.filename}: {name} is stored in another file")
    if place.dtype.kind not in "fiu":
        raise TrajectoryFileError(f"{file.filename}: {name} holds no numbers")
    if not _is_whole(place):  # HDF5 shows zeros there
        raise TrajectoryFileError(f"{file.filename}: parts of {name} are missing")
    found: Array = place[()].astype(np.float64)
    return found


def _is_whole(dataset: h5py.Dataset) -> bool:
    if dataset.chunks is None:
        return bool(dataset.id.get_storage_size() >= dataset.nbytes)
    chunks = [-(-n // size) for n, size in zip(dataset.shape, dataset.chunks, strict=True)]
    return bool(dataset.id.get_num_chunks() >= math.prod(chunks))


def _with_z(array: Array) -> Array:
    """(T, N, 3) of (T, N, D), z = 0 if there is none."""
    return np.concatenate([array, np.zeros((*array.shape[:-1], 3 - array.shape[-1]))], axis=-1)
