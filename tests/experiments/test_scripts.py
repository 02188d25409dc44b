"""Every script keeps the contract: files complete, deterministic, errors with a status of not 0."""

import json
import signal
import time
from dataclasses import replace

import numpy as np
import pytest
from commands import metrics_of, run, start

import mcmj
from mcmj.core.random_body import draw_body
from mcmj.learning.recipe import BODIES
from mcmj.mjcf.kept import provenance_of_model
from mcmj.mjcf.read import load_model, readouts_of_model

SHORT = ["--duration", "8", "--washout", "2", "--free-run", "13", "--window", "12", "--no-video"]
ON_CYCLE = ["--rest-runs", "0", "--held-runs", "0", "--rounds", "0"]
ON_CYCLE += ["--trial", "13", "--trial-window", "12"]
SHORT += ON_CYCLE


@pytest.fixture(scope="module")
def limit_cycle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("limit_cycle")
    options = ["--task", "quadratic", "--seed", "3", "--nodes", "12", *SHORT, "--out", folder]
    status, out, err = run("limit_cycle", *options)
    assert status == 0, err
    assert "quadratic" in out
    return folder, options


def test_limit_cycle_writes_everything(limit_cycle):
    folder, _ = limit_cycle
    document = metrics_of(folder)
    task = document["metrics"]["quadratic"]
    for name in ("orbit_error", "train_nrmse", "condition_number"):
        assert np.isfinite(task[name])
    assert "period_error" in task  # null here: such a short lesson teaches no cycle
    assert document["metrics"]["steps_per_second"] > 0
    assert document["metrics"]["closed_loop_cost_ratio"] > 0.5
    assert document["seed"] == 3
    assert document["config"]["settings"]["nodes"] == 12
    with np.load(folder / "trajectory.npz", allow_pickle=False) as arrays:
        assert arrays["quadratic/outputs"].shape == (13_000, 2)
        assert json.loads(str(arrays["provenance"]))["seed"] == 3
    body, w_out = mcmj.from_mjcf(folder / "body.xml")
    assert body == draw_body(3, replace(BODIES, nodes=12))
    model = load_model(folder / "body.xml")
    assert np.array_equal(readouts_of_model(model)["quadratic"], w_out)
    assert provenance_of_model(model)["config"]["seed"] == 3
    assert (folder / "limit_cycle.png").stat().st_size > 10_000
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_same_seed_same_bits(limit_cycle, tmp_path):
    folder, options = limit_cycle
    status, _, err = run("limit_cycle", *options[:-1], tmp_path, "--quiet")
    assert status == 0, err
    assert (tmp_path / "body.xml").read_text() == (folder / "body.xml").read_text()
    with np.load(folder / "trajectory.npz") as a, np.load(tmp_path / "trajectory.npz") as b:
        assert np.array_equal(a["quadratic/outputs"], b["quadratic/outputs"])


def test_a_body_file_with_its_readout_is_not_taught_again(limit_cycle, tmp_path):
    folder, _ = limit_cycle
    options = ["--task", "quadratic", "--body", folder / "body.xml", *SHORT, "--out", tmp_path]
    status, out, err = run("limit_cycle", *options)
    assert status == 0, err
    assert "not taught" in out
    assert metrics_of(tmp_path)["metrics"]["quadratic"]["train_nrmse"] is None


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--task", "waltz"], "unknown task 'waltz'; valid choices: a path to a .csv file, all,"),
        (["--body", "nowhere.xml"], "no such body file: 'nowhere.xml'"),
        (["--body", "nobody"], "unknown body 'nobody'; valid choices:"),
        (["--k1", "-1", "2"], "k1: expected (low, high) with 0 < low <= high"),
        (["--window", "5"], "window: expected at least 1.5 periods"),
        (["--out", "/dev/null/results"], "cannot write to the output folder"),
    ],
)
def test_bad_arguments_end_with_a_message(tmp_path, options, text):
    status, _, err = run("limit_cycle", *SHORT, "--out", tmp_path, *options)
    assert status not in (0, None)
    assert text in " ".join(err.replace("│", " ").split())
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_a_run_that_blows_up_says_so(tmp_path):
    options = ["--task", "quadratic", "--seed", "0", "--feedback-scale", "1e7"]
    status, _, err = run("limit_cycle", *SHORT, *options, "--out", tmp_path, "--quiet")
    assert status == 1
    assert "blew up after t = " in err
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_nothing_half_written(tmp_path):
    process = start(
        "limit_cycle", "--seed", "1", "--free-run", "5000", "--no-video", "--quiet",
        "--out", tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # in a background shell
    )  # fmt: skip
    end = time.monotonic() + 60
    while not list(tmp_path.glob(".checkpoint-*")):  # at work, no longer importing
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode not in (0, None)
    assert "interrupted" in err
    # what was done is kept for the next run, hidden; no result is there
    assert all(path.name.startswith(".checkpoint-") for path in tmp_path.iterdir())


@pytest.mark.slow
def test_success_rate(tmp_path):
    options = ["--seeds", "2", "--seed", "5", "--nodes", "10", "--duration", "6"]
    options += ["--washout", "2", "--free-run", "20", *ON_CYCLE, "--quiet", "--out", tmp_path]
    status, _, err = run("success_rate", *options)
    assert status == 0, err
    document = metrics_of(tmp_path)
    assert document["scenario"] == "success_rate"
    assert document["metrics"]["all_tasks"]["of"] == 2
    body, w_out = mcmj.from_mjcf(tmp_path / "best.xml")
    assert w_out is None
    assert body == draw_body(document["metrics"]["best_seed"], replace(BODIES, nodes=10))


@pytest.mark.slow
def test_speed_accuracy(tmp_path):
    methods = ["mujoco_Euler", "mujoco_leapfrog", "twin_rk4"]
    options = ["--bodies", "toolbox_n10", "--methods", *methods, "--steps-ms", "0.5", "1", "2"]
    options += ["--repeats", "1", "--no-attractor", "--quiet", "--out", tmp_path]
    status, _, err = run("speed_accuracy", *options)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    cells = {name: metrics["toolbox_n10"][name]["1"] for name in methods}
    assert all(cell["stable"] for cell in cells.values())
    assert cells["mujoco_leapfrog"]["error"] < 0.1 * cells["mujoco_Euler"]["error"]
    assert metrics["reference_self_consistency"] < 1e-8
    assert set(metrics["order"]) == set(methods)
    assert (tmp_path / "speed_accuracy.csv").read_text().count("\n") == 10


@pytest.mark.slow
def test_gaits(tmp_path):
    options = ["--gaits", "trot", "pace", "--seed", "3", "--nodes", "12", "--engine", "twin"]
    options += ["--duration", "10", "--washout", "4", "--free-run", "8", "--before", "5"]
    options += ["--after", "10", "--from-rest", "8", "--window", "8", "--out", tmp_path]
    status, out, err = run("gaits", *options)
    assert status == 0, err
    assert "from \\ to" in out
    metrics = metrics_of(tmp_path)["metrics"]
    assert set(metrics) == {"trot", "pace", "switch", "worst_error"}
    assert {"orbit_error", "switching_time"} <= set(metrics["switch"]["trot_to_pace"])
    assert {"orbit_error", "phase_lag_error"} <= set(metrics["pace"])
    assert set(readouts_of_model(load_model(tmp_path / "body.xml"))) == {"trot", "pace"}
    for figure in ("gaits.png", "gait_diagram.png"):
        assert (tmp_path / figure).stat().st_size > 10_000


@pytest.mark.slow
def test_benchmark(tmp_path):
    options = ["--steps", "50", "--repeats", "1", "--sizes", "10", "20", "--memory-steps", "1000"]
    status, out, err = run("benchmark", *options, "--json", "--out", tmp_path)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    assert json.loads(out[out.index("{") :]) == metrics
    ratios = ("closed_loop_ratio", "force_learning_ratio", "twin_ratio", "twin_batch_ratio")
    costs = [f"{engine}_ns_per_spring_step" for engine in ("mujoco", "twin", "twin_batch")]
    for name in (*ratios, *costs, "threads2_speedup", "million_step_peak_mb"):
        assert metrics[name] > 0, name


@pytest.mark.slow
def test_emulate(tmp_path):
    options = ["--targets", "van_der_pol", "driven_duffing", "--integrators", "Euler", "RK4"]
    options += ["--steps-ms", "1", "2", "4", "--horizon", "2", "--g=-x1", "--out", tmp_path]
    status, out, err = run("emulate", *options)
    assert status == 0, err
    assert "driven_duffing" in out
    metrics = metrics_of(tmp_path)["metrics"]
    assert metrics["van_der_pol"]["Euler"]["order"] == pytest.approx(1.0, abs=0.1)
    assert metrics["user"]["RK4"]["error"] < 1e-11
    assert (tmp_path / "emulate.png").stat().st_size > 10_000


@pytest.mark.slow
def test_linearise(tmp_path):
    options = ["--sizes", "2", "--memory-sizes", "2", "--diversities", "1", "0.1", "--train", "5"]
    options += ["--test", "2", "--washout", "1", "--symbolic-masses", "2", "--out", tmp_path]
    status, out, err = run("linearise", *options)
    assert status == 0, err
    assert "feedback linearisable: yes" in out
    metrics = metrics_of(tmp_path)["metrics"]
    assert metrics["linearisability"]["nonlinear spring"]["linearisable"]
    assert metrics["controllability"]["2"]["rank"] == [4, 4, 2]
    assert (tmp_path / "linearisability.txt").read_text() in out


@pytest.mark.slow
def test_filters(tmp_path):
    options = ["--nodes", "10", "--train", "3", "--washout", "1", "--test", "2", "--symbols", "100"]
    options += ["--test-symbols", "40", "--lesson", "20", "--exam", "20", "--engine", "twin"]
    status, _, err = run("filters", *options, "--quiet", "--out", tmp_path)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    for task in ("volterra", "toolbox_narma", "narma10", "delayed_recall", "switch"):
        assert {"nrmse_std", "baseline_nrmse_std"} <= metrics[task].keys()
    assert {"filters.png", "switch.png"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.slow
def test_capacity(tmp_path):
    options = ["--nodes", "8", "--symbols", "200", "--max-delays", "10", "3", "--streams", "10"]
    options += ["--stream-symbols", "12", "--map-symbols", "150", "--stiffness", "1", "--damping"]
    options += ["1", "3", "--sizes", "5", "--strengths", "1", "10", "--quiet", "--out", tmp_path]
    status, _, err = run("capacity", *options)
    assert status == 0, err
    metrics = metrics_of(tmp_path)["metrics"]
    for name in ("memory_capacity", "ipc_total", "kernel_rank"):
        assert metrics[name] >= 0
    assert np.shape(metrics["maps"]["size_strength"]["ipc_total"]) == (1, 2)


@pytest.mark.slow
def test_perturb_and_swing_up(tmp_path):
    taught = ["--task", "quadratic", "--seed", "0", "--nodes", "12", "--engine", "twin"]
    taught += ["--duration", "12", "--washout", "4", *ON_CYCLE]
    runs = {
        "perturb": (["--before", "1", "--window", "1", "--after", "15", "--error-window", "12",
                     "--noise-curve", "0.1"], "frozen_x1", "recovery_time"),
        "swing_up": (["--free-run", "15", "--window", "12", "--kicks", "1",
                      "--trial", "13", "--trial-window", "12"], "tasks", "quadratic"),
    }  # fmt: skip
    for name, (options, key, inner) in runs.items():
        out = tmp_path / name
        status, shown, err = run(name, *taught, *options, "--out", out)
        assert status == 0, err
        assert "results in" in shown
        assert inner in metrics_of(out)["metrics"][key]
        assert (out / f"{name}.png").stat().st_size > 10_000
        with np.load(out / "trajectory.npz", allow_pickle=False) as arrays:
            assert any(array.endswith("/outputs") for array in arrays)


@pytest.mark.slow
def test_certify(tmp_path):
    options = ["--task", "quadratic", "--body", "quadratic", "--free-run", "25", "--recovery", "25",
               "--scales", "1", "--phases", "2", "--kicks", "0.5", "--pushes", "1", "--copies", "4",
               "--refine", "2", "--out", tmp_path]  # fmt: skip
    status, out, err = run("certify", *options)
    assert status == 0, err
    assert "leading nontrivial multiplier" in out
    wanted = {"floquet_multipliers", "leading_nontrivial", "basin_fraction", "lyapunov_exponent",
              "force_tolerance", "noise_tolerance"}  # fmt: skip
    assert wanted <= set(metrics_of(tmp_path)["metrics"])
    assert (tmp_path / "certificate.png").stat().st_size > 10_000
