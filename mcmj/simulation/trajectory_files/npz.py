"""Trajectories on disk with their body: NPZ, or Zarr by the file's suffix."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import RECORDABLE, Trajectory, join
from mcmj.mjcf.read import from_mjcf
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.models.reservoir_file import SETTINGS
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.trajectory_files.checks import check_body_fits, checked_trajectory, reading
from mcmj.utils import files
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError
from mcmj.utils.validation import Array

SUFFIXES = (".npz", ".zarr")


@dataclass(frozen=True)
class StoredRun:
    """What a trajectory file holds.

    Attributes:
        trajectory: what was recorded; the state after the last step is not kept.
        body, w_out: of the run, None if they were not given.
        provenance: config, seed and versions.
        reservoir: of the run, if it was no body, as MJCF for `Reservoir.open`.
    """

    trajectory: Trajectory
    body: Body | None
    w_out: Array | None
    provenance: dict[str, object]
    reservoir: str | None = None


def save_trajectory(
    path: str | Path,
    run: Trajectory | Iterable[Trajectory],
    *,
    body: Body | Reservoir | None = None,
    w_out: object = None,
    config: Mapping[str, object] | object = None,
    seed: int = 0,
) -> None:
    """Write a trajectory, or consecutive chunks of one (Simulation.stream), whole or not at all.

    A .zarr folder takes chunks one by one, so memory stays flat; .npz takes them joined.

    Args:
        path: ends with .npz or .zarr (needs the extra "files").
        body, w_out: kept as MJCF, so that the run can be drawn and gone on with; a reservoir
            that is no body is kept with the readout that it has.
        config, seed: go into the file's account of where it comes from, with all versions.

    Raises:
        InvalidArgumentError: another suffix, or no chunk.
        OutputError: the file cannot be written.
    """
    final = Path(path)
    _check_suffix(final)
    parts = iter([run] if isinstance(run, Trajectory) else run)
    xml: str | None = None
    if isinstance(body, Reservoir):
        xml = body.to_mjcf()
    elif body is not None:
        xml = to_mjcf(body, w_out=w_out)
    if final.suffix == ".zarr":
        from mcmj.simulation.trajectory_files.zarr import write_zarr  # its packages are an extra

        write_zarr(final, parts, xml, files.account(config, seed))
        return
    chunks = list(parts)
    if not chunks:
        raise InvalidArgumentError("run", "at least one chunk", "none")
    whole = join(chunks)
    arrays = {"times": whole.times}
    arrays |= {name: whole.get(name) for name in RECORDABLE if getattr(whole, name) is not None}
    if xml is not None:
        arrays["body"] = np.array(xml)
    files.write_arrays(final, arrays, config, seed)


def load_trajectory(path: str | Path) -> StoredRun:
    """Read what `save_trajectory` wrote; of a .zarr folder, all of it into memory.

    Raises:
        InvalidArgumentError: another suffix.
        TrajectoryFileError: no such file, or not a whole trajectory of finite numbers.
        BodyFileError: its body is none.
        MissingExtraError: Zarr is not installed.
    """
    final = Path(path)
    _check_suffix(final)
    if not final.exists():
        raise TrajectoryFileError(f"no such trajectory file: {final}")
    if final.suffix == ".zarr":
        from mcmj.simulation.trajectory_files.zarr import read_zarr

        trajectory, xml, account = read_zarr(final)
    else:
        trajectory, xml, account = _read_npz(final)
    if xml is None:
        return StoredRun(trajectory, None, None, account)
    if not isinstance(xml, str) or not xml.lstrip().startswith("<"):  # a path would be read
        raise TrajectoryFileError(f"{final}: expected a body in MJCF, got {str(xml)[:40]!r}")
    if SETTINGS in xml:
        return StoredRun(trajectory, None, None, account, xml)
    body, w_out = from_mjcf(xml)
    with reading(final, "a run of its own body"):
        check_body_fits(trajectory, body)
    return StoredRun(trajectory, body, w_out, account)


def _check_suffix(path: Path) -> None:
    if path.suffix not in SUFFIXES:
        raise InvalidArgumentError("path", f"a name that ends with {' or '.join(SUFFIXES)}", path)


def _read_npz(path: Path) -> tuple[Trajectory, str | None, dict[str, object]]:
    with reading(path, "an NPZ file of a trajectory"):
        if not path.is_file() or not is_zipfile(path):  # a pipe would be waited for
            raise TrajectoryFileError(f"{path}: not an NPZ file")
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            if "times" not in file:
                raise TrajectoryFileError(
                    f"{path}: expected an array 'times' beside {', '.join(RECORDABLE)}, got "
                    f"{', '.join(sorted(file)) or 'nothing'}"
                )
            xml = str(file["body"]) if "body" in file else None
            account = json.loads(str(file["provenance"])) if "provenance" in file else {}
            recorded = {name: file[name] for name in RECORDABLE if name in file}
            return checked_trajectory(file["times"], recorded), xml, account
