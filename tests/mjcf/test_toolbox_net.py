"""Nets of the authors' toolbox: written as its `save` does, run as its program ran them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import mcmj
from mcmj.mjcf import toolbox_net
from mcmj.mjcf.toolbox_net import load_toolbox_net
from mcmj.reference.integration import integrate
from mcmj.utils.errors import BodyFileError, UnknownNameError

FIXTURE = Path(__file__).parents[1] / "data" / "toolbox_rk.npz"


@pytest.fixture(scope="module")
def toolbox():
    with np.load(FIXTURE) as data:
        return dict(data)


def net_structure(data):
    """The structure that init_ms_sys_net.m builds, with the fixture's numbers."""

    def column(values):
        return np.asarray(values, dtype=float).reshape(-1, 1)

    n = len(data["positions"])
    points = {
        "states": np.hstack([data["positions"], np.zeros((n, 2))]),
        "force": np.zeros((n, 2)),
        "fixed": column(data["fixed"]),
    }
    springs = {name: column(data[name]) for name in ("k1", "k3", "d1", "d3")}
    springs |= {"from": column(data["springs"][:, 0] + 1), "to": column(data["springs"][:, 1] + 1)}
    springs |= {"l0": column(data["rest_lengths"]), "dist_old": column(data["rest_lengths"])}
    return {
        "init_data": {"num": n, "time_step": data["timestep"], "P": points},
        "P": points, "W": springs, "W_in": data["w_in"], "W_fb": data["w_fb"],
        "W_out": data["w_out"], "readout_type": "LENGTHS", "rk_steps": 2.0,
        "fixed_idx": column(np.flatnonzero(data["fixed"]) + 1),
    }  # fmt: skip


def test_a_net_runs_as_the_authors_program_ran_it(toolbox, tmp_path):
    savemat(tmp_path / "net.mat", {"net": net_structure(toolbox), "len": 400.0})
    net = load_toolbox_net(tmp_path / "net.mat")
    assert (net.method, net.springs, net.timestep) == ("toolbox_rk", "native", 1e-3)
    options = {"method": net.method, "timestep": net.timestep, "inputs": toolbox["inputs"]}
    taught = integrate(net.body, offset=toolbox["teacher"], gate=0, **options)
    assert np.abs(taught.lengths - toolbox["teacher_lengths"]).max() < 1e-13  # measured 3e-15

    # saved again after teacher forcing, as net1 is: the closed loop goes on from there
    end, later = taught.final_state, net_structure(toolbox)
    later["P"] = later["P"] | {"states": np.hstack([end.positions, end.velocities])}
    later["W"] = later["W"] | {"dist_old": end.previous_lengths.reshape(-1, 1)}
    savemat(tmp_path / "net1.mat", {"net1": later})
    saved = load_toolbox_net(tmp_path / "net1.mat")
    assert saved.body == net.body
    closed = integrate(saved.body, w_out=saved.w_out, initial_state=saved.state, **options)
    assert np.abs(closed.outputs - toolbox["closed_outputs"]).max() < 1e-13


def test_a_net_becomes_a_body_file(toolbox, tmp_path):
    savemat(tmp_path / "net.mat", {"net": net_structure(toolbox)})
    net = load_toolbox_net(tmp_path / "net.mat")
    body, w_out = mcmj.from_mjcf(mcmj.to_mjcf(net.body, w_out=net.w_out))
    assert np.array_equal(w_out, toolbox["w_out"])
    assert np.array_equal(body.springs, toolbox["springs"])
    assert np.array_equal(body.w_fb, toolbox["w_fb"])


def test_columns_and_empty_weights_keep_their_shape(toolbox, tmp_path):
    net = net_structure(toolbox)
    net["W_in"], net["W_fb"] = np.zeros((len(toolbox["positions"]), 0)), net["W_fb"][:, :1]
    net["W_out"], net["tansig"] = net["W_out"][:, :1], 0.0
    del net["rk_steps"]
    savemat(tmp_path / "net.mat", {"net": net})
    read = load_toolbox_net(tmp_path / "net.mat")
    assert (read.body.n_inputs, read.body.n_outputs) == (0, 1)
    assert np.array_equal(read.w_out, toolbox["w_out"][:, :1])
    assert (read.method, read.springs) == ("toolbox_euler", "tansig")


def test_what_is_no_net_is_said(toolbox, tmp_path):
    with pytest.raises(BodyFileError, match=r"no such \.mat file"):
        load_toolbox_net(tmp_path / "nowhere.mat")
    (tmp_path / "text.mat").write_text("not Matlab's")
    with pytest.raises(BodyFileError, match=r"not a \.mat file"):
        load_toolbox_net(tmp_path / "text.mat")
    savemat(tmp_path / "other.mat", {"x": 1.0})
    with pytest.raises(BodyFileError, match="no structure with the fields P and W"):
        load_toolbox_net(tmp_path / "other.mat")
    net = net_structure(toolbox)
    savemat(tmp_path / "two.mat", {"net": net, "net1": net})
    with pytest.raises(UnknownNameError, match="valid choices: net, net1"):
        load_toolbox_net(tmp_path / "two.mat")
    broken = net | {"W": {k: v for k, v in net["W"].items() if k != "k3"}}
    savemat(tmp_path / "broken.mat", {"net": broken})
    with pytest.raises(BodyFileError, match="no field 'k3'"):
        load_toolbox_net(tmp_path / "broken.mat")


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (144, 5, "reader crashed"),  # the class of an array: SciPy follows a null pointer
        (163, 127, "not a .mat file"),  # a size: 17 GB
        (5000, None, "not a .mat file"),  # cut off
    ],
)
def test_a_damaged_file_is_one_clear_error(place, value, said, toolbox, tmp_path):
    savemat(tmp_path / "net.mat", {"net": net_structure(toolbox)})
    data = bytearray((tmp_path / "net.mat").read_bytes())
    if value is None:
        del data[place:]
    else:
        data[place] = value
    (tmp_path / "net.mat").write_bytes(data)
    with pytest.raises(BodyFileError, match=said) as caught:
        load_toolbox_net(tmp_path / "net.mat")
    assert "\n" not in str(caught.value)


def test_a_reader_that_hangs_is_not_waited_for(toolbox, tmp_path, monkeypatch):
    savemat(tmp_path / "net.mat", {"net": net_structure(toolbox)})
    (tmp_path / "slow.py").write_text("import time; time.sleep(60)")
    monkeypatch.setattr(toolbox_net, "READER", tmp_path / "slow.py")
    monkeypatch.setattr(toolbox_net, "PATIENCE", 0.5)
    with pytest.raises(BodyFileError, match=r"not read after 0\.5 s"):
        load_toolbox_net(tmp_path / "net.mat")
