"""Trajectories come back to the bit, with their body, their axes and their units."""

import numpy as np
import pytest

import mcmj
from mcmj.core.trajectory import RECORDABLE
from mcmj.simulation.trajectory_files.npz import load_trajectory, save_trajectory
from mcmj.utils.errors import InvalidArgumentError, OutputError, TrajectoryFileError

EVERY = ("lengths", "outputs", "positions", "velocities")


@pytest.fixture(scope="module")
def run(body, w_out):
    return mcmj.Simulation(body, w_out=w_out).rollout(250, record=EVERY)


def same(a, b):
    names = ("times", *RECORDABLE)
    return all(
        (getattr(a, name) is None and getattr(b, name) is None)
        or np.array_equal(getattr(a, name), getattr(b, name))
        for name in names
    )


@pytest.fixture(params=[".npz", ".zarr"])
def path(request, tmp_path):
    if request.param == ".zarr":
        pytest.importorskip("zarr", reason="the extra 'files' is not installed")
        pytest.importorskip("xarray", reason="the extra 'files' is not installed")
    return tmp_path / f"run{request.param}"


def test_everything_comes_back(path, run, body, w_out):
    save_trajectory(path, run, body=body, w_out=w_out, config={"drive": "none"}, seed=7)
    stored = load_trajectory(path)
    assert same(stored.trajectory, run)
    assert stored.body == body
    assert np.array_equal(stored.w_out, w_out)
    assert stored.provenance["seed"] == 7
    assert stored.provenance["config"] == {"drive": "none"}
    assert stored.provenance["versions"]["mujoco"]
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_chunks_make_one_trajectory_and_replace_an_older_one(path, run, body, w_out):
    save_trajectory(path, run)
    simulation = mcmj.Simulation(body, w_out=w_out)
    parts = simulation.stream(250, record=("outputs", "positions"), chunk=100)
    save_trajectory(path, parts, body=body, w_out=w_out, seed=7)
    stored = load_trajectory(path)
    assert np.array_equal(stored.trajectory.positions, run.positions)
    assert np.array_equal(stored.trajectory.times, run.times)
    assert stored.trajectory.lengths is None
    assert stored.body == body
    assert stored.provenance["seed"] == 7


def test_an_ensemble_has_an_axis_of_copies(path, body, w_out):
    readouts = np.stack([w_out, 2 * w_out, 0 * w_out])
    runs = mcmj.Ensemble(body, copies=3, w_out=readouts).rollout(50)
    save_trajectory(path, runs)
    assert same(load_trajectory(path).trajectory, runs)


def test_an_interrupt_leaves_what_was_there(path, run):
    save_trajectory(path, run)

    def chunks():
        yield run
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save_trajectory(path, chunks())
    assert same(load_trajectory(path).trajectory, run)
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_zarr_has_named_axes_with_units(run, tmp_path):
    pytest.importorskip("zarr", reason="the extra 'files' is not installed")
    xarray = pytest.importorskip("xarray", reason="the extra 'files' is not installed")
    save_trajectory(tmp_path / "run.zarr", run)
    with xarray.open_zarr(tmp_path / "run.zarr", consolidated=False) as dataset:
        assert dataset["lengths"].dims == ("time", "spring")
        assert dataset["positions"].dims == ("time", "node", "axis")
        units = {name: dataset[name].attrs["units"] for name in ("time", *EVERY)}
        late = dataset["outputs"].sel(time=slice(0.1, None))
        assert np.array_equal(late.values, run.outputs[100:])
    assert units == {
        "time": "s", "lengths": "m", "outputs": "1", "positions": "m", "velocities": "m/s",
    }  # fmt: skip


def test_what_cannot_be_read_or_written_is_said(path, run):
    with pytest.raises(TrajectoryFileError, match="no such trajectory file"):
        load_trajectory(path)
    with pytest.raises(InvalidArgumentError, match=r"\.npz or \.zarr"):
        save_trajectory(path.with_suffix(".csv"), run)
    with pytest.raises(InvalidArgumentError, match="at least one chunk"):
        save_trajectory(path, [])
    if path.suffix == ".npz":
        path.write_bytes(b"not an archive")
    else:
        path.mkdir()
    with pytest.raises(TrajectoryFileError, match=r"not an NPZ file|not a trajectory in Zarr"):
        load_trajectory(path)
    with pytest.raises(OutputError, match="cannot write"):
        save_trajectory(path.parent / "nowhere" / "deep" / path.name, run)


def test_another_npz_is_no_trajectory(tmp_path):
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    with pytest.raises(TrajectoryFileError, match=r"expected an array 'times'.*got x"):
        load_trajectory(tmp_path / "other.npz")


def test_named_signals_are_a_data_frame(body, run):
    pytest.importorskip("xarray", reason="the extra 'files' is not installed")
    from mcmj.simulation.trajectory_files.zarr import to_dataset

    names = mcmj.Simulation(body).signal_names
    frame = to_dataset(run, names).lengths.to_pandas()
    assert list(frame.columns) == list(names)
    assert np.array_equal(frame[names[1]], run.lengths[:, 1])
    assert np.array_equal(frame.index, run.times)
    with pytest.raises(InvalidArgumentError, match=f"signals: expected {len(names)} names, got 2"):
        to_dataset(run, names[:2])
