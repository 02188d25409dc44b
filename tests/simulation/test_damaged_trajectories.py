"""Trajectory files that are damaged or another's: one clear error, and no other file is read."""

import json
import os
import pickle
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import mcmj
from mcmj.simulation.trajectory_files.npz import load_trajectory, save_trajectory
from mcmj.utils.errors import McmjError, TrajectoryFileError

RECORD = ("lengths", "outputs", "positions", "velocities")


@pytest.fixture(scope="module")
def run(body, w_out):
    return mcmj.Simulation(body, w_out=w_out).rollout(60, record=RECORD)


class Marked:
    """Leaves a file where it is unpickled."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return open, (self.path, "w")


def refused(load, path):
    with pytest.raises(TrajectoryFileError) as caught:
        load(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


# --- NPZ -----------------------------------------------------------------------------------


def npz_changes(run, body, mark):
    arrays = {name: run.get(name) for name in RECORD} | {"times": run.times}
    other = mcmj.to_mjcf(mcmj.random_body(3, nodes=12))
    return {
        "no numbers": {"lengths": np.full(run.lengths.shape, "1.5")},
        "objects": {"lengths": np.array([Marked(mark)], dtype=object)},
        "complex": {"lengths": run.lengths + 1j},
        "not finite": {"lengths": np.where(run.lengths > 0, np.nan, 0.0)},
        "too few": {"outputs": run.outputs[:-1]},
        "too many axes": {"positions": run.positions[None, None]},
        "three dimensions": {"positions": np.zeros((60, body.n_nodes, 3))},
        "other copies": {"lengths": np.stack([run.lengths] * 2)},
        "times of two axes": {"times": run.times[:, None]},
        "provenance no JSON": {"provenance": np.array("{")},
        "another body": {"body": np.array(other)},
        "a path": {"body": np.array("/etc/passwd")},
        "body of numbers": {"body": np.zeros(3)},
    }, arrays


def test_npz_files_of_something_else(run, body, tmp_path):
    mark, path = tmp_path / "executed", tmp_path / "run.npz"
    changes, arrays = npz_changes(run, body, mark)
    for change in changes.values():
        np.savez(path, **arrays | change)
        refused(load_trajectory, path)
    np.save(tmp_path / "array", run.lengths)
    (tmp_path / "array.npy").rename(path)
    refused(load_trajectory, path)
    path.write_bytes(pickle.dumps({"times": Marked(mark)}))
    refused(load_trajectory, path)
    path.unlink()
    os.mkfifo(path)
    refused(load_trajectory, path)
    assert not mark.exists()


# --- Zarr ----------------------------------------------------------------------------------


@pytest.fixture
def folder(run, body, tmp_path):
    pytest.importorskip("zarr", reason="the extra 'files' is not installed")
    pytest.importorskip("xarray", reason="the extra 'files' is not installed")
    save_trajectory(tmp_path / "run.zarr", run, body=body)
    return tmp_path / "run.zarr"


def edit(path, **changes):
    document = json.loads(path.read_text())
    path.write_text(json.dumps(document | changes))


CHUNK = "lengths/c/0/0"
DAMAGE = {
    "a missing chunk": lambda f: (f / CHUNK).unlink(),
    "and zeros in its place": lambda f: (
        (f / CHUNK).unlink(),
        edit(f / "lengths/zarr.json", fill_value=0.0),
    ),
    "a truncated chunk": lambda f: os.truncate(f / CHUNK, 100),
    "an empty chunk": lambda f: os.truncate(f / CHUNK, 0),
    "an absurd shape": lambda f: edit(f / "lengths/zarr.json", shape=[10**12, 10**6]),
    "another shape": lambda f: edit(f / "lengths/zarr.json", shape=[59, 3]),
    "another type": lambda f: edit(f / "lengths/zarr.json", data_type="int64"),
    "unknown type": lambda f: edit(f / "lengths/zarr.json", data_type="pickle"),
    "no JSON": lambda f: (f / "zarr.json").write_text("{"),
    "provenance no text": lambda f: edit(f / "zarr.json", attributes={"provenance": 3}),
    "body no text": lambda f: edit(f / "zarr.json", attributes={"body": 3}),
    "no times": lambda f: (f / "time/zarr.json").unlink(),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_zarr_folders(folder, damage):
    damage(folder)
    refused(load_trajectory, folder)


def test_a_zarr_folder_reads_no_other_file(folder, tmp_path):
    (folder / CHUNK).rename(tmp_path / "elsewhere")
    (folder / CHUNK).symlink_to(tmp_path / "elsewhere")
    refused(load_trajectory, folder)


def test_a_zarr_folder_unpickles_nothing(tmp_path):
    """The older format of Zarr can hold pickles."""
    pytest.importorskip("xarray")
    mark, folder = tmp_path / "executed", tmp_path / "run.zarr"
    (folder / "time").mkdir(parents=True)
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    (folder / "time" / ".zattrs").write_text('{"_ARRAY_DIMENSIONS": ["time"]}')
    array = {
        "zarr_format": 2, "shape": [1], "chunks": [1], "dtype": "|O", "compressor": None,
        "fill_value": None, "order": "C", "filters": [{"id": "pickle", "protocol": 5}],
    }  # fmt: skip
    (folder / "time" / ".zarray").write_text(json.dumps(array))
    (folder / "time" / "0").write_bytes(pickle.dumps(Marked(mark)))
    refused(load_trajectory, folder)
    assert not mark.exists()


# --- HDF5 ----------------------------------------------------------------------------------


@pytest.fixture
def hdf5(run, body, tmp_path):
    pytest.importorskip("h5py", reason="the extra 'files' is not installed")
    from mcmj.simulation.trajectory_files.openprc import load_openprc, save_openprc

    save_openprc(tmp_path / "simulation.h5", run, body)
    load_openprc(tmp_path / "simulation.h5")
    return tmp_path / "simulation.h5"


NODES = "time_series/nodes/positions"


def external_link(file, h5py, other):
    file[NODES] = h5py.ExternalLink(other, NODES)


def external_group(file, h5py, other):
    del file["time_series"]
    file["time_series"] = h5py.ExternalLink(other, "time_series")


def external_storage(file, h5py, other):
    file.create_dataset(NODES, (60, 8, 3), "f4", external=[(other, 0, 60 * 8 * 3 * 4)])


def virtual(file, h5py, other):
    layout = h5py.VirtualLayout((60, 8, 3), "f4")
    layout[:] = h5py.VirtualSource(other, NODES, (60, 8, 3))
    file.create_virtual_dataset(NODES, layout)


def text(file, h5py, other):
    file[NODES] = np.full((60, 8, 3), b"0")


def objects(file, h5py, other):
    file.create_dataset(NODES, (60, 8, 3), h5py.string_dtype())


def missing_chunks(file, h5py, other):
    file.create_dataset(NODES, (60, 8, 3), "f4", chunks=(10, 8, 3))[:50] = 0.0


def never_written(file, h5py, other):
    file.create_dataset(NODES, (10**9, 8, 3), "f4")


def wrong_shape(file, h5py, other):
    file[NODES] = np.zeros((60, 8, 2))


def wrong_length(file, h5py, other):
    file[NODES] = np.zeros((59, 8, 3))


def not_finite(file, h5py, other):
    file[NODES] = np.full((60, 8, 3), np.inf)


def a_group(file, h5py, other):
    file.create_group(NODES)


@pytest.mark.parametrize(
    "damage",
    [
        external_link, external_group, external_storage, virtual, text, objects, missing_chunks,
        never_written, wrong_shape, wrong_length, not_finite, a_group,
    ],
)  # fmt: skip
def test_hdf5_files_that_are_damaged_or_lead_to_others(damage, hdf5, tmp_path):
    h5py = pytest.importorskip("h5py")
    from mcmj.simulation.trajectory_files.openprc import load_openprc

    other = tmp_path / "other.h5"
    other.write_bytes(hdf5.read_bytes())
    with h5py.File(hdf5, "r+") as file:
        del file[NODES]
        damage(file, h5py, str(other))
    refused(load_openprc, hdf5)


# --- bytes ---------------------------------------------------------------------------------


def flips(path, count=150):
    """Load a file with bytes changed or cut off, over and over; raises what is no error of ours."""
    from mcmj.simulation.trajectory_files.openprc import load_openprc

    load = load_openprc if path.suffix == ".h5" else load_trajectory
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for number in range(count):
        damaged = bytearray(whole[: rng.integers(len(whole))] if number % 5 == 0 else whole)
        for _ in range(3):
            if damaged:
                damaged[rng.integers(min(len(damaged), 9000))] = rng.integers(256)
        path.write_bytes(damaged)
        with suppress(McmjError):
            load(path)


@pytest.mark.parametrize("kind", ["npz", "h5"])
def test_flipped_bytes_neither_crash_nor_raise_anything_else(kind, run, body, hdf5, tmp_path):
    path = hdf5
    if kind == "npz":
        path = tmp_path / "run.npz"
        save_trajectory(path, run, body=body)
    code = f"import pathlib, test_damaged_trajectories as t; t.flips(pathlib.Path({str(path)!r}))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=Path(__file__).parent, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
