"""Filter tasks against their definitions, written out; a body against no body; the switch."""

from dataclasses import replace

import numpy as np
import pytest

from mcmj.experiments.filters.config import Config, filtering_body
from mcmj.experiments.filters.run import run
from mcmj.experiments.filters.switching import SwitchConfig, pauses_held, run_switch
from mcmj.experiments.linearise.run import Config as LineariseConfig
from mcmj.experiments.linearise.run import run as linearise
from mcmj.metrics.orbits import nmse_var, nrmse_range, nrmse_std
from mcmj.targets import filter_tasks as tasks
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError


def test_volterra_is_the_double_sum():
    """Over both arguments of the kernel, as the toolbox does it."""
    task = tasks.volterra(1500)
    wave = tasks.sines(1500, 1e-3)
    assert task.inputs[:, 0] == pytest.approx(0.2 * wave)
    taus = 1e-3 * np.arange(200)
    bump = np.exp(-((taus - 0.1) ** 2) / (2 * 0.05**2))
    kernel = 1e-3 * np.outer(bump, bump)
    sums = np.zeros(1500)
    for k in range(1500):
        past = np.zeros(200)
        past[: min(k + 1, 200)] = wave[k::-1][:200]
        sums[k] = past @ kernel @ past
    assert task.targets[:, 0] == pytest.approx((sums - sums.mean()) / sums.std(), abs=1e-9)


def test_narma_recursions():
    """The toolbox's has u_(k-1) and y_k in one row; the standard one u_k and y_(k+1)."""
    wave = 0.1 * tasks.sines(300, 1e-3)
    wave[:10] = 0.0
    y = np.zeros(300)
    for k in range(10, 300):
        y[k] = 0.3 * y[k - 1] + 0.05 * y[k - 1] * y[k - 10 : k].sum()
        y[k] += 1.5 * wave[k - 10] * wave[k - 1] + 0.1
    task = tasks.toolbox_narma(300)
    assert task.targets[:, 0] == pytest.approx((y - y.mean()) / y.std(), abs=1e-9)
    task = tasks.narma10(np.random.default_rng(0), 200)
    u, z = (task.inputs[:, 0] + 1) / 4, task.targets[:, 0]
    assert (u.min() >= 0, u.max() <= 0.5) == (True, True)
    for k in range(30, 199):
        wanted = (
            0.3 * z[k - 1] + 0.05 * z[k - 1] * z[k - 10 : k].sum() + 1.5 * u[k - 9] * u[k] + 0.1
        )
        assert z[k] == pytest.approx(wanted, abs=1e-12)


def test_delays_and_recall():
    inputs = np.arange(1.0, 8.0)[:, None]
    assert tasks.delays(inputs, 3, 2)[5].tolist() == [6.0, 4.0, 2.0]
    assert tasks.delays(inputs, 3, 2)[1].tolist() == [2.0, 0.0, 0.0]
    assert tasks.delayed_recall(inputs, 2).targets[:, 0].tolist() == [0, 0, 1, 2, 3, 4, 5]


def test_the_switch_says_the_sign_of_the_last_pulse():
    task = tasks.switch(np.random.default_rng(0), 20_000, 1e-3, pulse=0.5, gaps=(1.0, 3.0))
    last = 0.0
    for u, y in zip(task.inputs[:, 0], task.targets[:, 0], strict=True):
        last = u if u != 0.0 else last
        if u == 0.0:
            assert np.sign(y) == last
    assert {-1.0, 0.0, 1.0} == set(task.inputs[:, 0])
    assert pauses_held(task, task.targets) == 1.0
    assert pauses_held(task, np.ones_like(task.targets)) < 1.0


@pytest.fixture(scope="module")
def quick():
    return Config(
        train=20.0, washout=5.0, test=5.0, symbols=500, washout_symbols=30, test_symbols=150,
        engine="twin", settings=replace(filtering_body(), nodes=30), taps=15,
        tasks=("volterra", "toolbox_narma", "narma10", "delayed_recall"),
    )  # fmt: skip


def test_a_body_does_what_linear_regression_cannot(quick):
    table = run(quick).metrics
    for name in ("volterra", "toolbox_narma"):
        assert table[name]["nrmse_std"] < 0.15 < 0.9 < table[name]["baseline_nrmse_std"]
    assert (
        table["delayed_recall"]["nrmse_std"] < 0.2 < table["delayed_recall"]["input_only_nrmse_std"]
    )
    assert table["delayed_recall"]["baseline_nrmse_std"] < 1e-12  # a plain delay is no feat
    assert table["narma10"]["nrmse_std"] < table["narma10"]["input_only_nrmse_std"]


def test_mujoco_computes_what_the_twin_computes(quick):
    short = replace(quick, tasks=("volterra",), train=4.0, washout=1.0, test=2.0)
    one, other = (run(replace(short, engine=e)).filters["volterra"] for e in ("mujoco", "twin"))
    assert one.errors == pytest.approx(other.errors, rel=1e-3)


def test_a_persistent_memory_needs_feedback():
    """Pauses of 15 s and more are beyond the body's own memory, and it was taught 6 s at most."""
    config = SwitchConfig(test_pauses=(15.0, 30.0))
    result = run_switch(config, 0, engine="twin").metrics
    assert result["pauses_held"] == 1.0
    assert result["baseline_pauses_held"] < 0.3
    assert result["nrmse_std"] < 0.6 < result["baseline_nrmse_std"]


def test_an_array_remembers_by_diversity():
    config = LineariseConfig(
        sizes=(2, 3), diversities=(1.0,), memory_sizes=(4,), train=10.0, test=5.0, washout=2.0,
        symbolic_masses=1,
    )  # fmt: skip
    result = linearise(config)
    diverse, equal = result.errors[4]
    assert diverse < 0.2 < 0.3 < equal < result.baseline
    assert [result.ranks[n] for n in (2, 3)] == [[4, 2], [6, 2]]


def test_wrong_arguments():
    with pytest.raises(UnknownNameError, match="unknown task 'waltz'"):
        Config(tasks=("waltz",))
    with pytest.raises(InvalidArgumentError, match="hold"):
        Config(hold=0.0)
    with pytest.raises(InvalidArgumentError, match="targets: expected 3 rows, got 2"):
        tasks.FilterTask("", np.zeros((3, 1)), np.zeros((2, 1)))


def test_normalised_errors_say_their_convention():
    """y* = 0, 2, 4, 6 has variance 5 and range 6; an error of 1 everywhere."""
    wanted = np.array([[0.0], [2.0], [4.0], [6.0]])
    assert nmse_var(wanted + 1, wanted) == pytest.approx(1 / 5)
    assert nrmse_std(wanted + 1, wanted) == pytest.approx(np.sqrt(1 / 5))
    assert nrmse_range(wanted + 1, wanted) == pytest.approx(1 / 6)
    assert nrmse_std(np.full_like(wanted, 3.0), wanted) == pytest.approx(1.0)
    two = np.hstack([wanted, 10 * wanted])
    assert nrmse_range(two + np.array([1.0, 10.0]), two) == pytest.approx(1 / 6)
    with pytest.raises(InvalidArgumentError, match="column 0 constant"):
        nrmse_std(wanted, np.ones_like(wanted))
    with pytest.raises(InvalidArgumentError, match=r"outputs: expected shape \(4, 1\)"):
        nrmse_std(wanted[:3], wanted)
