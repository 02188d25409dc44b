"""simulation.h5 as OpenPRC's README documents it."""

import numpy as np
import pytest

import mcmj
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError

h5py = pytest.importorskip("h5py", reason="the extra 'files' is not installed")

from mcmj.simulation.trajectory_files.openprc import load_openprc, save_openprc  # noqa: E402


@pytest.fixture(scope="module")
def run(body, w_out):
    simulation = mcmj.Simulation(body, w_out=w_out)
    return simulation.rollout(120, record=("positions", "velocities", "lengths"))


def test_the_documented_schema(run, body, tmp_path):
    save_openprc(tmp_path / "simulation.h5", run, body)
    with h5py.File(tmp_path / "simulation.h5") as file:
        series = file["time_series"]
        assert series["nodes/positions"].shape == (120, body.n_nodes, 3)
        assert series["nodes/positions"].dtype == np.float32
        assert (file.attrs["total_frames"], file.attrs["frame_rate"]) == (120, 1000.0)
        strain = run.lengths / body.rest_lengths - 1.0
        assert series["elements/bars/strain"][:] == pytest.approx(strain, rel=1e-6, abs=1e-12)
    again = load_openprc(tmp_path / "simulation.h5")
    assert again.positions == pytest.approx(run.positions, rel=1e-7)
    assert again.velocities == pytest.approx(run.velocities, rel=1e-7)
    assert again.times == pytest.approx(run.times, rel=1e-7)


def test_what_does_not_fit_is_said(run, body, tmp_path):
    with pytest.raises(InvalidArgumentError, match=r"positions \(T, N, D\) of one run"):
        save_openprc(tmp_path / "s.h5", mcmj.Simulation(body).rollout(3), body)
    with pytest.raises(TrajectoryFileError, match="no such trajectory file"):
        load_openprc(tmp_path / "nowhere.h5")
    with h5py.File(tmp_path / "empty.h5", "w"):
        pass
    with pytest.raises(TrajectoryFileError, match="expected time_series/time"):
        load_openprc(tmp_path / "empty.h5")
    save_openprc(tmp_path / "s.h5", run, body)
    with h5py.File(tmp_path / "s.h5", "r+") as file:
        file["time_series/nodes/positions"][0, 0, 2] = 0.5
    risen = load_openprc(tmp_path / "s.h5").positions
    assert risen.shape == (120, body.n_nodes, 3)
    assert (risen[0, 0, 2], np.abs(risen[1:, :, 2]).max()) == (0.5, 0.0)
