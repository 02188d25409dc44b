"""The commands of the robots: every part says something of every gait."""

import numpy as np
import pytest
from commands import metrics_of, run


@pytest.mark.slow
def test_walk(tmp_path):
    """The ground changes the stride only if coupled; a push that throws it over is a fall."""
    options = ["--parts", "walk", "adapt", "recover", "--gaits", "trot", "--settle", "2",
               "--walking", "3", "--before", "2", "--after", "2", "--starts", "1", "--moments", "1",
               "--slopes", "6", "--loads", "50", "--nudge", "3000"]  # fmt: skip
    status, out, err = run("walk", *options, "--no-video", "--out", tmp_path)
    assert status == 0, err
    assert "trot" in out
    metrics = metrics_of(tmp_path)["metrics"]
    assert metrics["trot"]["falls"] == 0
    assert metrics["trot"]["speed_m_s"] > 1.0
    for label, slower in (("uncoupled", 0.0), ("coupled", 0.009)):
        rows = metrics["adapt"]["trot"][label]["load"]
        assert not any(row["falls"] for row in rows.values())
        periods = [rows[load]["stride_period_s"]["median"] for load in ("0", "50")]
        assert periods[1] / periods[0] - 1 == pytest.approx(slower, abs=0.003)
        pushed = metrics["recover"]["trot"][label]["sideways"]
        assert pushed == {"falls": 1, "deviation": [None], "recovery_s": [None],
                          "phase_shift": [None]}  # fmt: skip
    for figure in ("footfalls.png", "adapt.png", "recover.png"):
        assert (tmp_path / figure).stat().st_size > 10_000


@pytest.mark.slow
def test_trunk(tmp_path):
    """Figure, readouts and metrics; seconds of learning are too few to ask for more than that."""
    options = ["--gaits", "bound", "--parts", "rest", "--seeds", "2", "--no-video"]
    options += ["--walking", "3", "--judged", "1", "--rounds", "1", "--round-duration", "4"]
    options += ["--trial", "2", "--out", tmp_path]
    status, out, err = run("trunk", *options)
    assert status == 0, err
    assert "bound" in out
    metrics = metrics_of(tmp_path)["metrics"]
    assert set(metrics) == {"bound", "seeds", "rest"}
    assert metrics["seeds"]["bound"]["upright"]["of"] == 2
    assert metrics["bound"]["taught_period_s"] == pytest.approx(0.3416, abs=1e-4)
    assert (tmp_path / "trunk.png").stat().st_size > 10_000
    with np.load(tmp_path / "readouts.npz") as arrays:
        assert arrays["bound/w_out"].shape[1] == 8


@pytest.mark.slow
def test_all_parts_of_trunk(tmp_path):
    options = ["--gaits", "trot", "bound", "--no-video", "--walking", "4", "--judged", "1.5"]
    options += ["--rounds", "2", "--round-duration", "6", "--trial", "2", "--survive", "1.5"]
    status, _, err = run("trunk", *options, "--teaching", "5", "--out", tmp_path)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    for name in ("trot", "bound"):
        assert "orbit_error" in metrics["regression"][name]
        survived = list(metrics["push"]["survived"][name].values())
        assert len(survived) == 4
        assert 0 < survived[0] <= metrics["push"]["of"]
    assert set(metrics["switch"]["trot"]) == {"bound"}
    same = metrics["steps"]["trot"]["1"]  # the walk again
    assert same["orbit_error"] == pytest.approx(metrics["trot"]["orbit_error"], rel=0.2)


@pytest.mark.slow
def test_all_parts_of_soft_robot(tmp_path):
    """Every part says something of every gait; seconds of learning are too few for more."""
    options = ["--gaits", "trot", "bound", "--no-video", "--walking", "4", "--judged", "2"]
    options += ["--rounds", "1", "--round-duration", "6", "--trial", "3", "--survive", "1.5"]
    options += ["--teaching", "5", "--pushes", "1", "--impulses", "10", "--symbols", "400"]
    status, _, err = run("soft_robot", *options, "--steps-ms", "0.2", "--out", tmp_path)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    for name in ("trot", "bound"):
        assert metrics[name]["upright"] == metrics[name]["of"] == 1
        assert metrics[name]["speed_m_s"] > 0.1
        assert metrics["energy"][name]["balance_error"] < 1e-3
        assert metrics["push"]["survived"][name]["10"] == 2
        assert metrics["controls"][name]["frozen"]["speed_m_s"] == pytest.approx(0.0, abs=0.05)
        assert metrics["controls"][name]["capacity"]["standing"]["memory_capacity"] > 1.0
        assert set(metrics["ground"][name]) == {
            "slope -0.05", "slope -0.02", "slope 0.02", "slope 0.05", "step 10 mm", "step 20 mm",
        }  # fmt: skip
    assert set(metrics["switch"]) == {"trot_to_bound", "bound_to_trot"}
    assert len(metrics["steer"]["robots"][0]["told"]) >= 7
    assert (tmp_path / "soft_robot.png").stat().st_size > 10_000
    with np.load(tmp_path / "readouts.npz") as arrays:
        assert arrays["bound/w_out"].shape[1] == 12
