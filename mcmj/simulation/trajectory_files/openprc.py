"""Trajectories as OpenPRC's simulation.h5, so that its readouts and analyses run on our bodies.

Needs the extra "files" (h5py). Schema of OpenPRC 0.1 (its README, section 3.1.6), float32:

    attributes  total_frames, frame_rate [1/s], dt [s]
    time_series/time (T,)   nodes/positions, nodes/velocities (T, N, 3), z = 0
    elements/bars/strain (T, L): l / l0 - 1

Bodies are not exchanged: OpenPRC's bars are linear, and its geometry.h5 has no place for cubic
stiffness and damping.
"""

from pathlib import Path

import numpy as np

from mcmj.core.body import Body, spring_lengths
from mcmj.core.trajectory import Trajectory
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError
from mcmj.utils.extras import extra
from mcmj.utils.files import whole_file
from mcmj.utils.validation import Array

with extra("files", "OpenPRC's files need h5py"):
    import h5py

_POSITIONS, _VELOCITIES = "time_series/nodes/positions", "time_series/nodes/velocities"


def save_openprc(path: str | Path, trajectory: Trajectory, body: Body) -> None:
    """Write a run with recorded positions (and velocities, if recorded) as simulation.h5.

    Raises:
        InvalidArgumentError: positions not recorded, or more than one run.
        OutputError: the file cannot be written.
    """
    positions = trajectory.positions
    if positions is None or positions.ndim != 3 or len(trajectory) < 2:
        raise InvalidArgumentError("trajectory", "positions (T, N, 2) of one run, T >= 2", "none")
    step = float(trajectory.times[1] - trajectory.times[0])
    strain = spring_lengths(positions, body.springs) / body.rest_lengths - 1.0
    arrays = {
        "time_series/time": trajectory.times,
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
    """Read the times, positions and velocities of a planar simulation.h5.

    Raises:
        TrajectoryFileError: no such file, not OpenPRC's, or nodes that leave the plane z = 0.
    """
    try:
        with h5py.File(path, "r") as file:
            arrays = {
                name: file[name][:].astype(np.float64)
                for name in ("time_series/time", _POSITIONS, _VELOCITIES)
                if name in file
            }
    except OSError as error:
        raise TrajectoryFileError(f"{path}: cannot be read as HDF5 ({error})") from error
    if not {"time_series/time", _POSITIONS} <= arrays.keys():
        raise TrajectoryFileError(f"{path}: expected time_series/time and {_POSITIONS} in it")
    if np.abs(arrays[_POSITIONS][..., 2]).max(initial=0.0) > 0.0:
        raise TrajectoryFileError(f"{path}: nodes leave the plane z = 0")
    moving = arrays.get(_VELOCITIES)
    return Trajectory(
        arrays["time_series/time"],
        positions=np.ascontiguousarray(arrays[_POSITIONS][..., :2]),
        velocities=None if moving is None else np.ascontiguousarray(moving[..., :2]),
    )


def _with_z(planar: Array) -> Array:
    return np.concatenate([planar, np.zeros((*planar.shape[:-1], 1))], axis=-1)
