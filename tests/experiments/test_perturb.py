"""Perturbations and swing-up: how results are measured, and that small bodies do it."""

from dataclasses import replace

import numpy as np
import pytest

from mcmj import Teaching, random_body, teach
from mcmj.core.random_body import BodySettings
from mcmj.experiments.perturb import run as perturb
from mcmj.experiments.swing_up import run as swing_up
from mcmj.learning.practice import Practice
from mcmj.learning.recipe import train
from mcmj.learning.regression import Regression
from mcmj.metrics.orbits import orbit_distances, orbit_error, recovery_time
from mcmj.metrics.success_rates import success_rate
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import stream

QUICK = perturb.Config(
    settings=BodySettings(nodes=12),
    teaching=Teaching(duration=30.0, washout=10.0, ridge_per_row=1e-6),
    practice=Practice(rounds=0, trial=20.0, trial_window=12.0),
    before=2.0, window=2.0, after=20.0, error_window=15.0, noise_curve=(0.1,), engine="twin",
)  # fmt: skip


def test_distances_are_to_the_orbit_over_its_radius():
    """Off the Lissajous curve along x2 at its top, where it is level."""
    goal = target("lissajous")
    top = goal.sample([0.0]) + np.array([0.0, 0.3])
    orbit = goal.orbit(1 << 16)
    radius = np.sqrt((orbit**2).sum(axis=1).mean())
    assert orbit_distances(top, goal)[0] == pytest.approx(0.3 / radius, rel=1e-6)
    assert orbit_distances(goal.sample([0.1, 3.0]), goal).max() < 1e-5


@pytest.mark.parametrize("rate", [0.2, 0.5, 1.0])
def test_recovery_time_begins_the_periods_whose_rms_distance_is_small(rate):
    """Of an orbit that is approached from outside, against the definition over all windows."""
    goal, step = target("quadratic"), 0.01
    times = step * np.arange(3000)
    outputs = (1.0 + np.exp(-rate * times))[:, None] * goal.sample(times)
    rows = round(goal.period / step)
    windows = np.lib.stride_tricks.sliding_window_view(orbit_distances(outputs, goal), rows)
    outside = np.flatnonzero(np.sqrt((windows**2).mean(axis=1)) > 0.05)
    expected = step * (outside[-1] + 1)
    assert 1.0 < expected < 20.0
    assert recovery_time(outputs, step, goal) == pytest.approx(expected, abs=1e-9)
    assert recovery_time(outputs, step, goal, tolerance=100.0) == 0.0


def test_recovery_needs_a_whole_period_inside():
    goal, step = target("quadratic"), 0.01
    outputs = goal.sample(step * np.arange(2000))
    outputs[2000 - round(0.9 * goal.period / step)] += 50.0
    assert recovery_time(outputs, step, goal) == np.inf


def test_success_rate_is_wilsons():
    row = success_rate([True] * 19 + [False])
    assert (row["successes"], row["of"]) == (19, 20)
    z, p, n = 1.959963984540054, 0.95, 20
    centre = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    np.testing.assert_allclose(row["interval_95"], [centre - half, centre + half], rtol=1e-9)


@pytest.mark.parametrize("bias", [False, True])
def test_a_weight_of_k_is_k_copies_of_the_rows(bias):
    rng = np.random.default_rng(0)
    x, y, x2, y2 = (rng.standard_normal((40, n)) + 1 for n in (4, 2, 4, 2))
    weighted, copied = Regression(bias=bias), Regression(bias=bias)
    for regression in (weighted, copied):
        regression.add(x, y)
    weighted.add(x2, y2, weight=3.0)
    for _ in range(3):
        copied.add(x2, y2)
    a, b = weighted.solve(0.1), copied.solve(0.1)
    np.testing.assert_allclose(a.w_out, b.w_out, rtol=1e-10)
    assert a.train_nrmse == pytest.approx(b.train_nrmse, rel=1e-10)
    assert (a.rows, b.rows) == (80, 160)
    with pytest.raises(InvalidArgumentError, match="weight"):
        weighted.add(x, y, weight=0.0)


def test_runs_from_rest_are_weighted_rows_and_leave_the_simulation_alone():
    body, goal, step = random_body(0, nodes=8), target("quadratic"), 2e-3
    settings = Teaching(
        duration=3.0, washout=1.0, rest_runs=2, away_duration=1.0, away_weight=0.01, noise=0.1
    )
    simulation = Simulation(body, timestep=step)
    fit = teach(simulation, goal, settings, seed=4)
    assert simulation.time == pytest.approx(3.0)
    plain = Simulation(body, timestep=step)
    noise, main = stream(4, "rest_noise"), stream(4, "teacher_noise")
    parts = []
    for seconds, skipped, weight, rng in (
        (1.0, 0.0, 0.01, noise), (1.0, 0.0, 0.01, noise), (3.0, 1.0, 1.0, main),
    ):  # fmt: skip
        clean = goal.sample(step * np.arange(round(seconds / step)))
        offset = clean + 0.1 * rng.standard_normal(clean.shape)
        plain.reset()
        lengths = plain.rollout(offset=offset, gate=0.0).lengths
        kept = slice(round(skipped / step), None)
        parts.append(np.sqrt(weight) * np.hstack([lengths, clean])[kept])
    rows = np.vstack(parts)
    x, y = rows[:, : body.n_springs], rows[:, body.n_springs :]
    w = np.linalg.lstsq(x, y)[0]
    assert np.abs(x @ (fit.w_out - w)).max() < 1e-7
    assert np.array_equal(simulation.state.positions, plain.state.positions)


def test_perturbations_are_what_they_are_called():
    result = perturb.run(QUICK)
    first, goal = result.bodies[0]["quadratic"], target("quadratic")
    window = slice(2000, 4000)
    for name, channel in (("frozen_x1", 0), ("frozen_x2", 1)):
        outputs = first.recoveries[name].outputs[window]
        assert np.ptp(outputs[:, channel]) == 0.0 < np.ptp(outputs[:, 1 - channel])
    runs = list(first.recoveries.values())
    for run in runs:
        assert run.boundaries == (0, 2000, 4000, 24_000)
        assert np.array_equal(run.outputs[:2000], runs[0].outputs[:2000])  # the same start
        assert run.times[0] == 0.0
        free = run.outputs[4000:]
        assert np.array_equal(free, run.clean[4000:])
        assert run.recovery_time == recovery_time(free, 1e-3, goal)
    noisy = first.recoveries["length_noise"]
    assert np.std((noisy.outputs - noisy.clean)[window]) > 0
    assert first.noise_errors[0] == noisy.orbit_error  # the same amplitude, the same noise
    table = result.metrics
    assert set(table) == {*QUICK.perturbations, "unperturbed", "noise_curve"}
    assert set(table["frozen_x1"]) == {"orbit_error", "recovery_time"}


def test_a_body_that_blows_up_has_not_recovered(monkeypatch):
    def blow_up(*args, **options):
        raise DivergenceError("gone", time=1.0, steps_done=1)

    monkeypatch.setattr(perturb, "run_schedule", blow_up)
    result = perturb.run(QUICK)
    assert result.metrics["frozen_x1"] == {"orbit_error": np.inf, "recovery_time": np.inf}
    monkeypatch.setattr(perturb, "train", blow_up)
    assert perturb.run(QUICK).readouts == {}


@pytest.mark.parametrize(
    "wrong",
    [
        {"task": "square"},
        {"seeds": 0},
        {"after": 5.0},
        {"error_window": 90.0},
        {"noise_curve": (0,)},
        {"body": "general", "seeds": 2},
    ],
)
def test_wrong_configurations_are_refused(wrong):
    with pytest.raises((InvalidArgumentError, UnknownNameError)):
        perturb.Config(**wrong)


SWING = swing_up.Config(
    task="quadratic", seed=0, free_run=20.0, window=12.0, engine="twin", kicks=2,
    settings=BodySettings(nodes=12),
    teaching=Teaching(duration=30.0, washout=10.0, rest_runs=1),
    practice=Practice(rounds=2, round_duration=5.0, trial=20.0, trial_window=12.0),
)  # fmt: skip


def test_swing_up_starts_from_total_rest_and_is_measured_as_said():
    (tasks,) = swing_up.run(SWING).bodies
    run = tasks["quadratic"]
    body, *_ = swing_up.limit_cycle.get_body(SWING.of_seed(0))
    taught = Simulation(body, engine="twin")
    fit = train(taught, run.target, 0, teaching=SWING.teaching, practice=SWING.practice).fit
    np.testing.assert_allclose(run.outputs[0], body.rest_lengths @ fit.w_out, atol=1e-5)
    assert run.swing_up_time == recovery_time(run.outputs, 1e-3, run.target)
    assert run.orbit_error == orbit_error(run.outputs[-12_000:], run.target)
    assert run.orbit_error <= max(run.practice_errors)  # this run is one of the trials
    speeds, arrived = stream(0, "initial_state"), []
    for _ in range(2):
        taught.reset()
        taught.set_state(velocities=0.02 * speeds.standard_normal((12, 2)))
        outputs = taught.rollout(20_000, record=("outputs",)).outputs
        arrived.append(orbit_error(outputs[-12_000:], run.target) < 0.05)
    assert run.kicked_fraction == np.mean(arrived)
    again = swing_up.run(SWING)
    assert np.array_equal(again.bodies[0]["quadratic"].outputs, run.outputs)
    assert again.metrics["orbit_error"] == run.orbit_error


@pytest.mark.parametrize(
    "wrong", [{"seeds": 0}, {"kicks": -1}, {"kick_speed": np.nan}, {"body": "general", "seeds": 2}]
)
def test_wrong_swing_ups_are_refused(wrong):
    with pytest.raises(InvalidArgumentError):
        swing_up.Config(**wrong)


@pytest.mark.slow
def test_the_quadratic_body_recovers_from_all_of_fig_6():
    result = perturb.run(perturb.Config(engine="twin", noise_curve=()))
    for name, recovery in result.bodies[0]["quadratic"].recoveries.items():
        assert recovery.orbit_error < 0.02, name
        assert recovery.recovery_time < 20, name


@pytest.mark.slow
def test_the_general_body_swings_up_on_all_tasks():
    result = swing_up.run(swing_up.Config(engine="twin"))
    assert result.metrics["orbit_error"] < 0.02
    assert result.metrics["swing_up_time"] < 30


def test_all_tasks_of_many_bodies_are_what_each_is_alone():
    """By the name of the task; only the first body keeps its outputs."""
    config = replace(QUICK, task="all", seeds=2, after=30.0, error_window=20.0, noise_curve=())
    result = perturb.run(config)
    assert set(result.metrics) == {"van_der_pol", "quadratic", "lissajous"}
    alone = perturb.run(replace(config, task="quadratic"))
    for name in config.perturbations:
        assert alone.metrics["seeds"][name] == result.metrics["quadratic"]["seeds"][name]
    first, second = (body["quadratic"].recoveries["frozen_x1"] for body in alone.bodies)
    assert len(first.outputs) > 0 == len(second.outputs)
