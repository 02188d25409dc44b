"""Designed bodies: what passes is confirmed from outside, and nothing depends on the way there."""

from dataclasses import replace

import numpy as np
import pytest

import mcmj
from mcmj.analysis.promise import linear_measures
from mcmj.core.random_body import draw_body
from mcmj.experiments.design import one_body, trade_off
from mcmj.experiments.design.config import Config
from mcmj.experiments.design.judges import InputDriven, Tried
from mcmj.experiments.design.run import run
from mcmj.experiments.input_driven import run as input_driven
from mcmj.experiments.input_driven.config import DRAWN
from mcmj.learning.lessons import Teaching
from mcmj.metrics.orbits import orbit_error
from mcmj.mjcf.bundled import open_body
from mcmj.reference.integration import integrate_smooth
from mcmj.search.body_space import BodySpace
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import stream

GOAL = mcmj.target("van_der_pol")
SHORT = Teaching(duration=20.0, washout=5.0)
TINY = one_body.Config(
    nodes=6, evaluations=4, checks=1, judged=1, free_run=26.0, teaching=SHORT
)  # fmt: skip
LEARNS = replace(TINY, nodes=10, seed=21, free_run=60.0, teaching=Teaching())  # as it is drawn


def without_times(metrics):
    return {key: value for key, value in metrics.items() if key != "seconds"}


def test_a_seed_gives_the_same_bits():
    one, two = (without_times(one_body.run(TINY).metrics) for _ in range(2))
    assert one == two
    other = one_body.run(replace(TINY, seed=1)).metrics
    assert other["designed"] != one["designed"]


def test_a_search_at_random_may_try_as_many_bodies_and_begins_with_the_same():
    result = one_body.run(TINY)
    assert result.hunt.tried == TINY.evaluations
    assert result.found.tried == TINY.evaluations
    assert not result.found.passed
    assert result.found.scores[0] == result.hunt.scores[0]
    assert result.found.scores[1] != result.hunt.scores[1]


def test_a_body_that_learns_as_it_is_drawn_is_left_alone():
    result = one_body.run(LEARNS)
    assert result.hunt.passed
    assert result.hunt.tried == 1
    assert result.body == mcmj.random_body(21, nodes=10)
    assert result.verdicts["random"].metrics == result.verdicts["designed"].metrics
    assert max(result.verdicts["designed"].errors) < 0.01
    assert result.mujoco.worst == pytest.approx(result.verdicts["designed"].errors[0], rel=1e-3)
    assert result.exact == pytest.approx(result.verdicts["designed"].errors[0], rel=0.1)


def test_what_is_finished_is_kept_and_gone_on_from(tmp_path):
    config = Config(**{**vars_of(TINY), "seeds": 2}, workers=1)
    whole = run(config, store=tmp_path / "whole")
    run(replace(config, seeds=1), store=tmp_path / "half")  # as one killed after its first body
    told = []
    halves = run(config, store=tmp_path / "half", on_body=told.append)
    assert len(told) == 2
    for one, two in zip(whole.bodies.bodies, halves.bodies.bodies, strict=True):
        assert without_times(one) == without_times(two)
    again = run(config, store=tmp_path / "half")
    assert again.bodies == halves.bodies  # times too: nothing was run again


def vars_of(config):
    return {name: getattr(config, name) for name in one_body.Config.__dataclass_fields__}


def test_measures_before_teaching_meet_what_was_learned(tmp_path):
    config = Config(parts=("predictors",), nodes=6, measured=12, teaching=SHORT, workers=1)
    found = run(config, store=tmp_path / "store").metrics["predictors"]["van_der_pol"]
    assert found["of"] == 12
    bodies = [mcmj.random_body(seed, nodes=6) for seed in range(12)]
    good = np.array([learned(body, seed) for seed, body in enumerate(bodies)])
    assert found["successes"] == good.sum()
    assert 0 < good.sum() < 12
    gains = np.array([linear_measures(body, GOAL.period)["gain"] for body in bodies])
    order = np.mean([a > b for a in gains[good] for b in gains[~good]])
    assert found["auc"]["gain"] == pytest.approx(order)


def learned(body, seed):
    """Taught, then from total rest: by the library's own functions."""
    sim = mcmj.Simulation(body, engine="twin")
    mcmj.teach(sim, GOAL, SHORT, seed=seed)
    sim.reset()
    return orbit_error(sim.rollout(60_000).outputs[-20_000:], GOAL) < 0.05


@pytest.mark.slow
def test_input_driven_bodies_are_judged_as_by_their_experiment():
    config = replace(InputDriven().config, inputs=(1.0,), settings=replace(DRAWN, nodes=15))
    config = replace(config, practice=replace(config.practice, rounds=0))
    body = mcmj.random_body(1, **vars(config.settings))
    found = InputDriven(config).full(body, 1)
    theirs = input_driven.run(replace(config, seed=1))
    assert found.errors == tuple(theirs.outcomes[0].orbit_errors.values())
    assert (found.w_out == theirs.first.w_out).all()


def test_scores_of_bodies_that_blow_up_or_leave_are_in_order():
    errors = [(0.01,), (0.2,), (2.0,), (np.inf,)]
    scores = [Tried(some).score for some in errors]
    assert scores == sorted(scores)
    assert np.isfinite(scores).all()
    assert Tried((0.01, np.inf)).worst == np.inf
    assert Tried((0.01, np.inf)).score < Tried((0.1, np.inf)).score


def test_a_front_is_what_nothing_beats_in_both():
    rng = np.random.default_rng(0)
    points = rng.random((60, 2)).round(1)  # with ties
    beaten = [((points <= p).all(axis=1) & (points < p).any(axis=1)).any() for p in points]
    best = np.unique(points[~np.array(beaten)], axis=0)
    assert (trade_off.front(points) == best).all()


def test_a_trade_off_tries_as_many_at_random_and_noise_costs():
    config = trade_off.Config(nodes=4, tries=3, free_run=26.0, teaching=SHORT)
    result = trade_off.run(config)
    assert len(result.designed) >= 1 + 3 * len(trade_off.WEIGHTS)
    body = draw_body(int(stream(0, "random_search").integers(2**31)), config.judge.settings(4))
    assert (result.random[1] == config.judge.noisy(body, 0, config.sensor_noise).errors).all()
    assert len(front := trade_off.front(result.designed))
    assert (front.min(axis=0) == result.designed.min(axis=0)).all()
    judge, body = LEARNS.judge, mcmj.random_body(21, nodes=10)
    quiet, small, large = (judge.noisy(body, 0, x).errors for x in (1e-9, 1e-2, 3e-2))
    assert quiet[0] == pytest.approx(quiet[1], rel=1e-3)
    assert quiet[0] == small[0] == judge.quick(body, 0).worst
    assert quiet[1] < small[1] < large[1]


def test_bad_configs():
    with pytest.raises(UnknownNameError, match="unknown task 'waltz'"):
        Config(task="waltz")
    with pytest.raises(InvalidArgumentError, match="aim: expected at most the threshold"):
        Config(aim=0.1)
    with pytest.raises(UnknownNameError, match="part"):
        Config(parts=("head",))
    with pytest.raises(InvalidArgumentError, match="nodes"):
        Config(parts=("smallest",), sizes=(2,))
    with pytest.raises(InvalidArgumentError, match="sizes: expected at least one, each once"):
        Config(parts=("smallest",), sizes=())


@pytest.mark.parametrize(
    ("task", "nodes", "most"),
    [
        ("van_der_pol", 3, 0.05),
        ("van_der_pol", 10, 0.01),
        ("quadratic", 3, 0.05),
        ("lissajous", 8, 0.05),
    ],
)
def test_the_designed_bodies_that_come_along_run_from_rest_and_learn_anew(task, nodes, most):
    stored, goal = open_body(f"designed_{task}_{nodes}"), mcmj.target(task)
    assert stored.body.n_nodes == nodes
    drawn = mcmj.random_body(stored.provenance["body"]["seed"], nodes=nodes)
    assert (stored.body.springs == drawn.springs).all()
    sim = mcmj.Simulation(stored.body, engine="twin", w_out=stored.w_out)
    for seed in (None, 5):  # the file's readout, then one of another noise
        if seed is not None:
            mcmj.teach(sim, goal, Teaching(), seed=seed)
        sim.reset()
        sim.rollout(80_000, record=())
        assert orbit_error(sim.rollout(20_000).outputs, goal) < most


@pytest.mark.slow
@pytest.mark.parametrize(("task", "nodes", "seed"), [("van_der_pol", 10, 0), ("lissajous", 15, 0)])
def test_a_body_that_failed_is_designed_and_confirmed_from_outside(task, nodes, seed, tmp_path):
    result = one_body.run(one_body.Config(task=task, nodes=nodes, seed=seed))
    assert not result.verdicts["random"].success
    assert result.verdicts["designed"].success
    path = tmp_path / "designed.xml"
    path.write_text(result.xml)
    stored, goal = open_body(str(path)), mcmj.target(task)
    drawn = mcmj.random_body(seed, nodes=nodes)
    x = stored.provenance["x"]
    assert stored.body == BodySpace(drawn, stored.provenance["varied"]).body(np.array(x))
    assert (stored.body.springs == drawn.springs).all()
    sim = mcmj.Simulation(stored.body, w_out=stored.w_out, **stored.settings)  # MuJoCo, from rest
    sim.rollout(40_000, record=())
    assert orbit_error(sim.rollout(20_000).outputs, goal) < 0.05
    exact = integrate_smooth(stored.body, steps=60_000, w_out=stored.w_out, rtol=1e-7)
    assert orbit_error(exact.outputs[-20_000:], goal) < 0.05
