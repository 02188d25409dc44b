"""Gaits of one body: what is measured is what ran; the body that comes with mcmj; errors."""

import numpy as np
import pytest

import mcmj
from mcmj.core.random_body import BodySettings
from mcmj.experiments.gaits import run as gaits
from mcmj.experiments.gaits.config import Config, get_body
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.metrics import gaits as gaitmetrics
from mcmj.metrics import orbits
from mcmj.mjcf.bundled import StoredBody, body_names, body_path
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.targets.gaits import GAITS, gait_target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError

SMALL = BodySettings(nodes=20, n_outputs=4)
QUICK = Config(
    gaits=("trot", "bound"), settings=SMALL, engine="twin", free_run=15.0, before=2.0, after=16.0,
    from_rest=15.0, window=10.0, phases=1,
    practice=Practice(rounds=0, trial=12.0, trial_window=10.0),
    teaching=Teaching(duration=20.0, washout=5.0, ridge_per_row=1e-6),
)  # fmt: skip


@pytest.fixture(scope="module")
def quick():
    return gaits.run(QUICK)


def test_a_switch_replaces_the_readout_and_nothing_else(quick):
    """Outputs before are those of the first readout, from the state of its free run; then the
    second readout reads the same lengths."""
    first = quick.first
    trot, bound = first.gaits["trot"], first.gaits["bound"]
    run = first.switches["trot", "bound"]
    assert run.switched == 2000
    assert len(run.outputs) == 18_000
    simulation = mcmj.Simulation(first.body, engine="twin")
    mcmj.teach(simulation, trot.target, QUICK.teaching, 0)
    free = simulation.rollout(15_000).outputs
    assert np.array_equal(free, trot.free.outputs)
    before = simulation.rollout(2000).outputs
    simulation.set_readout(bound.w_out)
    after = simulation.rollout(16_000).outputs
    assert np.array_equal(np.concatenate([before, after]), run.outputs)
    assert np.abs(after[0] - before[-1]).max() > 1e-3


def test_runs_from_rest_start_from_rest(quick):
    for gait in quick.first.gaits.values():
        start = quick.first.body.rest_lengths @ gait.w_out
        np.testing.assert_allclose(gait.from_rest.outputs[0], start, atol=1e-9)


def test_numbers_are_those_of_the_outputs(quick):
    table = quick.metrics
    assert set(table) == {"trot", "bound", "switch", "worst_error"}
    assert set(table["switch"]) == {"trot_to_bound", "bound_to_trot"}
    run = quick.first.switches["trot", "bound"]
    last, goal = run.outputs[-10_000:], gait_target("bound")
    row = table["switch"]["trot_to_bound"]
    assert row["orbit_error"] == orbits.orbit_error(last, goal)
    assert row["period_error"] == orbits.relative_period_error(last, 1e-3, goal)
    time = gaitmetrics.switching_time(run.outputs[2000:], 1e-3, goal)
    assert row["switching_time"] == time
    free = quick.first.gaits["trot"].free
    period = orbits.period(free.outputs[-10_000:], 1e-3, gait_target("trot").period)
    lags = gaitmetrics.phase_lags(free.outputs[-10_000:], 1e-3, period)
    assert np.array_equal(table["trot"]["phase_lags"], lags)
    assert {"orbit_error", "phase_lag_error", "swing_up_time"} <= set(table["trot"]["from_rest"])
    for kind, rows in {
        "free_run": [table["trot"], table["bound"]],
        "from_rest": [table["trot"]["from_rest"], table["bound"]["from_rest"]],
        "switch": table["switch"].values(),
    }.items():
        worst = max(max(row["orbit_error"], row["period_error"]) for row in rows)
        assert table["worst_error"][kind] == worst


def test_rates_over_seeds():
    short = Config(
        gaits=("bound",), seeds=2, settings=SMALL, engine="twin", teaching=QUICK.teaching,
        free_run=10.0, after=10.0, from_rest=10.0, window=10.0,
        practice=QUICK.practice,
    )  # fmt: skip
    table = gaits.run(short).metrics["seeds"]
    assert [one["seed"] for one in table["outcomes"]] == [0, 1]
    assert table["all"]["of"] == 2
    for one in table["outcomes"]:
        assert one["all"] == (one["free_run"] and one["switch"] and one["from_rest"])


def test_a_body_that_blows_up_does_not_walk(monkeypatch):
    def blow_up(*args, **options):
        raise DivergenceError("gone", time=1.0, steps_done=1)

    monkeypatch.setattr(gaits, "run_schedule", blow_up)
    lost = gaits.run(QUICK).metrics["switch"]["trot_to_bound"]
    assert lost["orbit_error"] == lost["switching_time"] == np.inf
    monkeypatch.setattr(gaits.Course, "attend_all", blow_up)
    table = gaits.run(QUICK).metrics
    assert table["trot"]["orbit_error"] == table["trot"]["from_rest"]["orbit_error"] == np.inf


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"gaits": ("walk", "waltz")}, "unknown gait 'waltz'; valid choices: bound, pace, trot"),
        ({"gaits": ()}, "gaits: expected at least one, each once"),
        ({"gaits": ("walk", "walk")}, "gaits: expected at least one, each once"),
        ({"seeds": 0}, "seeds: expected an integer >= 1"),
        ({"after": 5.0}, "after: expected a number in"),
        ({"body": "gaits", "seeds": 2}, "seeds: expected 1 beside a body"),
    ],
)
def test_wrong_configurations_are_refused(wrong, text):
    with pytest.raises((InvalidArgumentError, UnknownNameError), match=text):
        Config(**wrong)


def test_a_body_without_the_channels_and_a_wrong_readout_are_refused():
    with pytest.raises(
        InvalidArgumentError, match=r"body: expected 4 feedback channels \(LF, RF, LH, RH\), got 2"
    ):
        gaits.run(Config(body="general"))
    body = mcmj.random_body(0, 12, n_outputs=4)
    wrong = {"trot": np.zeros((body.n_springs + 2, 4))}
    with pytest.raises(InvalidArgumentError, match=r"readout trot: expected \d+ rows"):
        gaits.run_body(QUICK, StoredBody(body, None, wrong, {}, {}), 0)
    with pytest.raises(UnknownNameError, match="unknown gait 'walk'; valid choices: bound, trot"):
        gaits.run_body(QUICK, StoredBody(body, None, {"walk": wrong["trot"]}, {}, {}), 0)
    with pytest.raises(InvalidArgumentError, match="window: expected a number in"):
        gaits.run(Config(gaits=("trot",), window=6.0))


def test_the_committed_body_has_its_four_readouts():
    assert "gaits" in body_names()
    stored = get_body(Config(), 0)
    body, source = stored.body, stored.provenance
    assert set(stored.readouts) == set(GAITS)
    assert (body.n_nodes, body.n_outputs) == (50, 4)
    drawn = mcmj.core.random_body.draw_body(
        source["body"]["seed"], BodySettings(**source["body"]["settings"])
    )
    for name in drawn.__dataclass_fields__:  # exp and log differ in the last digit by machine
        np.testing.assert_allclose(getattr(drawn, name), getattr(body, name), rtol=1e-14)


@pytest.mark.slow
def test_the_committed_body_alone_runs_and_switches_in_mujoco():
    """From its file and nothing else: from rest into a walk, then through all other gaits."""
    model = load_model(body_path("gaits"))
    readouts = readouts_of_model(model)
    body, w_out = mcmj.from_mjcf(body_path("gaits"))
    assert np.array_equal(w_out, readouts["walk"])  # the one that is active in the file
    simulation = mcmj.Simulation(body, w_out=w_out)
    for name in ("walk", "trot", "bound", "pace", "walk"):
        simulation.set_readout(readouts[name])
        outputs = simulation.rollout(60_000, record=("outputs",)).outputs[-20_000:]
        goal = gait_target(name)
        assert orbits.orbit_error(outputs, goal) < 0.005, name
        period = orbits.period(outputs, 1e-3, goal.period)
        assert period == pytest.approx(goal.period, rel=2e-3), name
        lags = gaitmetrics.phase_lags(outputs, 1e-3, period)
        assert gaitmetrics.phase_lag_error(lags, goal) < 0.005, name


@pytest.mark.slow
def test_the_committed_body_makes_all_switches():
    result = gaits.run(Config(engine="twin"))
    assert result.first.successes(0.05)["all"]
    table = result.metrics
    assert max(table[name]["orbit_error"] for name in GAITS) < 0.005
    assert max(row["orbit_error"] for row in table["switch"].values()) < 0.005
