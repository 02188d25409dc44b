"""Rhythms chosen by an input: cycles of a signal, the sweep, the experiment, what is refused."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mcmj
from mcmj.core.random_body import BodySettings, draw_body
from mcmj.experiments.input_driven import lessons as input_lessons
from mcmj.experiments.input_driven import run as input_driven
from mcmj.experiments.input_driven.config import Config, get_start
from mcmj.experiments.input_driven.sweep import Branch, Sweep, branches
from mcmj.learning.lessons import Lesson, Teaching
from mcmj.learning.practice import Practice
from mcmj.learning.regression import fit_readout
from mcmj.learning.teaching import teach_lessons
from mcmj.metrics import orbits
from mcmj.metrics.cycles import cycles
from mcmj.simulation.simulation import Simulation
from mcmj.targets.input_profiles import Profile
from mcmj.targets.input_systems import DrivenSystem
from mcmj.targets.limit_cycles import quadratic
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjWarning, UnknownNameError
from mcmj.utils.seeds import stream

SMALL = BodySettings(nodes=20, n_inputs=1, input_scale=2.0, feedback_fraction=1.0)
QUICK = Config(
    profile="lin 1 2 15, hold 2 10", run_in=5.0, inputs=(2.0, 1.2), curve=(1.0,), free_run=16.0,
    window=9.0, sweep=15.0, every=5, noise=0.3, engine="twin", settings=SMALL,
    practice=Practice(rounds=0, round_duration=20.0, trial=12.0, trial_window=9.0),
)  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return input_driven.run(QUICK)


def test_cycles_of_a_chirp():
    """u = a(t) sin(2 pi (f t + c t^2)), frequency f + 2 c t."""
    step, f, c = 1e-3, 0.5, 0.01
    t = step * np.arange(40_000)
    found = cycles((1 + 0.02 * t) * np.sin(2 * np.pi * (f * t + c * t**2)), step)
    np.testing.assert_allclose(found.frequencies, f + 2 * c * found.times, rtol=1e-5)
    np.testing.assert_allclose(found.amplitudes, 1 + 0.02 * found.times, rtol=1e-3)
    assert len(found.times) == 34  # passages after 1, 2, .. 35 of 36 turns


def test_a_signal_without_a_cycle_has_none():
    for values in (np.zeros(100), np.ones(100), np.linspace(-1, 1, 100)):
        assert len(cycles(values, 1e-3).times) == 0


def branch(amplitude, frequency=0.2):
    inputs = np.geomspace(0.1, 5.0, 30)
    return Branch(inputs, np.full(30, amplitude), np.full(30, frequency))


def test_hysteresis_is_the_difference_between_the_ways():
    sweep = Sweep(body=(branch(1.1), branch(1.05, 0.21)), target=(branch(1.0), branch(1.0, 0.2)))
    found = sweep.differences()
    assert found["inputs"] == pytest.approx((0.1, 5.0))
    assert found["amplitude_hysteresis"] == pytest.approx(0.05)
    assert found["target_amplitude_hysteresis"] == 0.0
    assert found["amplitude_error"] == pytest.approx(0.1)
    assert found["frequency_hysteresis"] == pytest.approx(0.05)
    assert found["frequency_error"] == pytest.approx(0.05)
    lost = replace(sweep, body=(branch(1.0), Branch(*np.empty((3, 0)))))
    assert set(lost.differences().values()) == {np.inf, None}
    low = Branch(np.array([0.1, 0.2, 5.0]), np.array([2.0, 1.0, 1.0]), np.full(3, 0.2))
    from_low = replace(sweep, body=(low, branch(1.0)))
    assert from_low.differences()["amplitude_hysteresis"] == pytest.approx(1.0)
    assert from_low.differences(0.2)["amplitude_hysteresis"] == pytest.approx(0.0, abs=1e-12)
    assert from_low.differences(6.0)["inputs"] is None


def test_branches_are_the_two_ways_by_increasing_input():
    profile, step = Profile.parse("log 4 1 60, log 1 4 60"), 1e-2
    t = step * np.arange(12_000)
    signal = profile(t) * np.sin(2 * np.pi * t)  # as large as the input
    down, up = branches(profile, signal, step)
    for way in (down, up):
        assert (np.diff(way.inputs) > 0).all()
        np.testing.assert_allclose(way.amplitudes, way.inputs, rtol=0.02)
    assert len(down.inputs) + len(up.inputs) >= 117


def test_teaching_is_the_regression_over_the_course(result):
    """The same by hand: noisy teacher and input in, every fifth row after the run-in out."""
    body, course, step = draw_body(0, SMALL), QUICK.course, QUICK.timestep
    t = step * np.arange(30_000)
    clean = input_driven.SYSTEM.follow(course)(t)
    noisy = clean + 0.3 * stream(0, "teacher_noise").standard_normal(clean.shape)
    simulation = Simulation(body, engine="twin")
    lengths = simulation.rollout(inputs=course(t)[:, None], offset=noisy, gate=0.0).lengths
    w_out = fit_readout(lengths[5000::5], clean[5000::5])
    fitted = result.first.w_out
    assert np.abs(lengths @ (fitted - w_out)).max() < 1e-5
    simulation.set_readout(fitted)
    held = simulation.rollout(inputs=np.full((16_000, 1), 1.2))
    assert np.abs(held.outputs - result.first.held[1.2].outputs).max() < 1e-9


def test_a_lesson_s_weight_is_that_of_the_squared_errors():
    body, course, step = draw_body(0, replace(SMALL, nodes=8)), Profile.parse("lin 1 2 4"), 1e-3
    t = step * np.arange(4000)
    clean = input_driven.SYSTEM.follow(course)(t)
    lesson = Lesson(
        lambda times: clean[np.rint(times / step).astype(int)], 4.0, 1.0,
        inputs=lambda times: course(times)[:, None], weight=lambda times: course(times) ** 3,
    )  # fmt: skip
    simulation = Simulation(body, engine="twin")
    lengths = simulation.rollout(inputs=course(t)[:, None], offset=clean, gate=0.0).lengths
    simulation.reset()
    fit = teach_lessons(simulation, [lesson], Teaching(noise=0.0, every=3), 0)
    rows = np.arange(1000, 4000)
    rows = rows[rows % 3 == 0]
    scale = course(t)[rows, None] ** 1.5
    w_out = fit_readout(scale * lengths[rows], scale * clean[rows])
    assert fit.rows == len(rows)
    assert np.abs(lengths @ (fit.w_out - w_out)).max() < 1e-6


def test_errors_are_what_their_names_say(result):
    for value, held in result.first.held.items():
        goal, last = quadratic(value), held.outputs[-9000:]
        period = orbits.period(last, 1e-3, goal.period)
        assert held.orbit_error == orbits.orbit_error(last, goal)
        assert held.frequency_error == pytest.approx(abs(goal.period / period - 1.0))
        assert held.amplitude_error == orbits.relative_amplitude_error(last, goal)
        assert held.orbit_error < 0.3  # a small body already follows its input
    table = result.metrics
    assert set(table["eps"]) == {"1", "1.2", "2"}
    assert {"orbit_error", "amplitude_error", "frequency_error"} <= set(table["eps"]["2"])
    assert table["taught_inputs"] == (1.0, 2.0)
    low, high = table["sweep"]["inputs"]
    assert low == pytest.approx(1.2, rel=0.1)
    assert 1.3 < high <= 2.0
    assert 0.0 < table["sweep"]["amplitude_hysteresis"] < 0.2


def test_the_input_changes_the_rhythm_the_right_way(result):
    held = result.first.held
    assert held[1.0].amplitude > held[1.2].amplitude > held[2.0].amplitude


def test_practice_of_the_jumps_that_it_misses_helps():
    practice = replace(QUICK.practice, rounds=2, round_runs=1, trial=16.0, good_enough=0.03)
    found = input_driven.run(replace(QUICK, practice=practice, curve=(), sweep=0.0))
    errors = found.metrics["practice_errors"]
    assert len(errors) == 3
    assert errors[0] > 0.05 > min(errors)
    worst = max(held.orbit_error for held in found.first.held.values())
    assert worst == pytest.approx(min(errors), rel=1e-9)  # the sums go in other chunks


def test_jumps_are_practised_from_the_cycle_where_the_course_ends(monkeypatch):
    """The target goes on under the constant input; half a turn later it is at -x (symmetry)."""
    heard = []

    class Recorded(DrivenSystem):
        def follow(self, profile, start=None):
            heard.append((str(profile), start))
            return super().follow(profile, start)

    monkeypatch.setattr(input_lessons, "SYSTEM", Recorded(**vars(input_driven.SYSTEM)))
    config = replace(QUICK, phases=2)
    lesson = input_lessons.course_lesson(config)
    simulation = Simulation(draw_body(0, SMALL), engine="twin")
    input_lessons.teach(config, simulation, lesson, 0, lambda steps: None)
    jumps = heard[2:]  # after the course and the cycle at its end
    assert [profile for profile, _ in jumps] == 2 * ["hold 2.0 20.0", "hold 1.2 20.0"]
    end = lesson.outputs(np.array([30.0]))[0]
    for sign, (_, start) in zip((1, 1, -1, -1), jumps, strict=True):
        assert np.abs(start - sign * end).max() < 2e-3  # half a period to the nearest step
    assert simulation.time == pytest.approx(30.0)


def test_rates_over_seeds_and_same_seed_same_bits(result):
    config = replace(QUICK, seeds=2, curve=(), sweep=0.0)
    again = input_driven.run(config)
    assert np.array_equal(again.first.w_out, result.first.w_out)
    rates = again.metrics["rates"]
    assert set(rates) == {"2", "1.2", "all_inputs"}
    assert rates["all_inputs"]["of"] == 2
    second = input_driven.run(replace(config, seed=1, seeds=1))
    assert rates["2"]["orbit_errors"][1] == second.first.held[2.0].orbit_error


def test_a_body_that_blows_up_is_a_failure(result, monkeypatch):
    def blow_up(*args, **options):
        raise DivergenceError("gone", time=1.0, steps_done=1)

    monkeypatch.setattr(input_driven, "drive", blow_up)
    found = input_driven.run(replace(QUICK, sweep=0.0))
    assert found.metrics["eps"]["2"]["orbit_error"] == np.inf
    monkeypatch.setattr(input_driven, "teach", blow_up)
    with pytest.raises(DivergenceError):
        input_driven.run(QUICK)


def test_a_body_file_with_its_readout_is_not_taught_again(result, tmp_path):
    path = tmp_path / "body.xml"
    body, w_out = result.first.start.body, result.first.w_out
    text = mcmj.to_mjcf(
        body, w_out=w_out, readouts={"mine": w_out}, provenance={"taught_inputs": [1.0, 2.0]}
    )
    path.write_text(text)
    config = replace(QUICK, settings=Config().settings, body=str(path), readout="mine")
    loaded = input_driven.run(config)
    assert loaded.first.practised is None
    assert loaded.first.start.body == body
    for value, held in loaded.first.held.items():  # the same rhythms from another start
        assert held.frequency == pytest.approx(result.first.held[value].frequency, rel=0.01)
    with pytest.warns(McmjWarning, match=r"outside the taught range of 1 to 2: 0\.5, 3;"):
        input_driven.run(replace(config, inputs=(2.0, 3.0), curve=(0.5,), sweep=0.0))
    with pytest.raises(UnknownNameError, match="unknown readout of the body file 'yours'; valid"):
        input_driven.run(replace(config, readout="yours"))


def test_inputs_outside_the_taught_range_warn():
    with pytest.warns(McmjWarning, match=r"outside the taught range of 1 to 2: 0\.5;"):
        input_driven.run(replace(QUICK, curve=(0.5,), sweep=0.0))


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"profile": "waltz"}, "profile: expected parts like lin START"),
        ({"profile": "lin 0 1 10"}, "profile's smallest value: expected a number in"),
        ({"inputs": ()}, "inputs: expected at least one"),
        ({"inputs": (1.0, -1.0)}, "inputs: expected a number in"),
        ({"window": 90.0}, "window: expected a number in"),
        ({"readout": "mine"}, "readout: expected a body file that holds it"),
        ({"body": "b.xml", "readout": "mine", "teach": True}, "readout: expected none of the file"),
        ({"body": "general", "seeds": 2}, "seeds: expected 1 beside a body"),
        ({"every": 0}, "every: expected an integer in"),
        ({"noise": -1.0}, "noise: expected a number"),
    ],
)
def test_wrong_configurations_are_refused(wrong, text):
    with pytest.raises(InvalidArgumentError, match=text):
        Config(**wrong)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"n_inputs": 0}, "body: expected one input channel, got 0"),
        ({"n_inputs": 2}, "body: expected one input channel, got 2"),
        ({"n_outputs": 3}, "body: expected 2 feedback channels, got 3"),
    ],
)
def test_bodies_without_the_channels_are_refused(settings, text):
    config = replace(QUICK, settings=replace(SMALL, **settings))
    with pytest.raises(InvalidArgumentError, match=text):
        get_start(config, 0)


def test_the_general_body_has_no_input():
    with pytest.raises(InvalidArgumentError, match="body: expected one input channel, got 0"):
        input_driven.run(Config(body="general"))


def test_a_window_must_hold_a_period_of_every_input():
    with pytest.raises(InvalidArgumentError, match=r"window: expected at least 6\.664 s"):
        input_driven.run(replace(QUICK, window=2.0))


@pytest.mark.slow
def test_script_writes_everything(tmp_path):
    options = [
        "--engine", "twin", "--nodes", "15", "--profile", "lin 1 2 10, hold 2 10", "--run-in", "5",
        "--inputs", "2", "1", "--curve", "1.4", "--free-run", "10", "--window", "8",
        "--sweep", "20", "--seeds", "2", "--rounds", "1", "--trial", "10", "--trial-window", "8",
        "--round-duration", "5", "--out", tmp_path,
    ]  # fmt: skip
    script = Path(mcmj.__file__).parent.parent / "scripts" / "input_driven.py"
    process = subprocess.run(
        [sys.executable, script, *map(str, options)], capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stderr
    assert "input all_inputs: " in process.stdout
    document = json.loads((tmp_path / "metrics.json").read_text())
    assert document["scenario"] == "input_driven"
    for value in ("2", "1", "1.4"):
        assert {"orbit_error", "amplitude_error", "frequency_error"} <= set(
            document["metrics"]["eps"][value]
        )
    assert document["metrics"]["rates"]["all_inputs"]["of"] == 2
    for name in ("input_curves.png", "input_jumps.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    with np.load(tmp_path / "trajectory.npz", allow_pickle=False) as arrays:
        assert arrays["eps_1/outputs"].shape == (10_000, 2)
    start = get_start(Config(body=str(tmp_path / "body.xml")), 0)
    assert start.w_out is not None
    assert start.taught == (1.0, 2.0)
    assert start.body == draw_body(0, replace(Config().settings, nodes=15))
    assert set(start.readouts) == set(start.lessons) == {"custom"}
    again = get_start(Config(body=str(tmp_path / "body.xml"), teach=True), 0)
    assert again.w_out is None
    assert again.taught == (0.1, 5.0)


@pytest.mark.slow
@pytest.mark.parametrize(("readout", "largest"), [("ramp", 0.05), ("mixed", 0.02)])
def test_the_body_that_comes_along_follows_its_input_in_mujoco(readout, largest):
    found = input_driven.run(
        Config(body="input_driven", readout=readout, curve=(), sweep=0.0, free_run=60.0)
    )
    assert set(found.first.held) == {0.2, 1.0, 5.0}
    assert max(held.orbit_error for held in found.first.held.values()) < largest
