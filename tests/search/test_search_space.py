"""Which configs a search tries: dotted overrides, lists, grids, random ranges."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.experiments.limit_cycle import config as limit_cycle_config
from mcmj.experiments.perturb import run as perturb
from mcmj.experiments.swing_up import run as swing_up
from mcmj.learning.recipe import TEACHING
from mcmj.search.overrides import override, parse_assignment, value_at
from mcmj.search.space import Choices, Range, expand, parse_dimension
from mcmj.search.summary import success_by_setting
from mcmj.utils.errors import InvalidArgumentError, McmjError, UnknownNameError

CONFIGS = [limit_cycle_config.Config(), perturb.Config(), swing_up.Config()]

VALUES = {
    "seed": st.integers(0, 10**6),
    "timestep": st.floats(1e-4, 1e-2),
    "settings.nodes": st.integers(3, 60),
    "settings.d1": st.tuples(st.floats(0.1, 1.0), st.floats(1.0, 9.0)),
    "settings.feedback_fraction": st.floats(0.05, 1.0),
    "teaching.noise": st.floats(0.0, 1.0),
    "teaching.bias": st.booleans(),
    "teaching.rest_runs": st.integers(0, 5),
}
CHANGES = st.fixed_dictionaries({}, optional=VALUES)


def flat(config, prefix=""):
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            yield from flat(value, f"{prefix}{field.name}.")
        else:
            yield prefix + field.name, value


@pytest.mark.parametrize("config", CONFIGS, ids=lambda c: type(c).__module__)
@given(changes=CHANGES)
def test_an_override_changes_its_fields_and_nothing_else(config, changes):
    before = dict(flat(config))
    assert dict(flat(override(config, changes))) == {**before, **changes}
    assert dict(flat(config)) == before


@pytest.mark.parametrize("config", CONFIGS, ids=lambda c: type(c).__module__)
def test_a_field_has_the_name_that_the_command_line_has(config):
    path = override(config, {"settings.feedback_scale": 3.0, "teaching.noise": 0.5})
    assert override(config, {"feedback-scale": 3.0, "noise": 0.5}) == path
    assert value_at(path, "feedback_scale") == value_at(path, "settings.feedback_scale") == 3.0


@given(changes=CHANGES)
def test_json_says_the_same_as_python(changes):
    as_json = {
        path: list(value) if isinstance(value, tuple) else value for path, value in changes.items()
    }
    config = CONFIGS[0]
    assert override(config, as_json) == override(config, changes)
    for path, value in changes.items():
        assert value_at(override(config, as_json), path) == value


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"node": 3}, UnknownNameError, "unknown field of Config 'node'; valid choices: body,"),
        ({"settings.node": 3}, UnknownNameError, "unknown field of BodySettings 'node'"),
        ({"seed.x": 3}, InvalidArgumentError, "seed.x: expected no fields in seed"),
        ({"settings.nodes": 3.5}, InvalidArgumentError, "settings.nodes: expected int, got 3.5"),
        ({"settings.nodes": True}, InvalidArgumentError, "settings.nodes: expected int, got True"),
        ({"settings.d1": [1, 2, 3]}, InvalidArgumentError, "settings.d1: expected tuple"),
        ({"task": 1}, InvalidArgumentError, "task: expected str, got 1"),
        ({"settings.d1": [2, 1]}, InvalidArgumentError, "d1: expected (low, high)"),
        ({"teaching.noise": "x"}, InvalidArgumentError, "teaching.noise: expected float, got 'x'"),
    ],
)
def test_a_wrong_override_is_named(changes, error, text):
    with pytest.raises(error) as caught:
        override(CONFIGS[0], changes)
    assert str(caught.value).startswith(text)


def test_fields_that_depend_on_each_other_change_together():
    # one by one, either order passes through a washout longer than the lesson
    config = override(CONFIGS[0], {"teaching.duration": 300.0, "teaching.washout": 200.0})
    back = override(config, {"teaching.washout": 20.0, "teaching.duration": TEACHING.duration})
    assert back == CONFIGS[0]


def test_integers_become_the_floats_that_they_are():
    config = override(CONFIGS[0], {"free_run": 60})
    assert type(config.free_run) is float
    assert override(CONFIGS[0], {"seed": None}).seed is None


def test_assignments():
    assert parse_assignment("a.b=[1, 2]") == ("a.b", [1, 2])
    assert parse_assignment("task = quadratic") == ("task", "quadratic")
    assert parse_assignment("body=null") == ("body", None)
    for text in ("nodes", "=3"):
        with pytest.raises(InvalidArgumentError, match="expected field=value"):
            parse_assignment(text)


BOUNDS = st.tuples(st.floats(1e-9, 1e9), st.floats(1e-9, 1e9)).map(sorted)


@given(
    bounds=BOUNDS, kind=st.sampled_from(["uniform", "log"]), u=st.floats(0, 1), v=st.floats(0, 1)
)
def test_ranges_are_monotone_and_keep_their_bounds(bounds, kind, u, v):
    part = Range(*bounds, kind)
    low, high = sorted((u, v))
    assert part.low <= part.at(low) <= part.at(high) <= part.high
    assert part.at(0.0) == pytest.approx(part.low)
    assert part.at(1.0) == pytest.approx(part.high)
    scale = np.log if kind == "log" else np.asarray
    expected = scale(part.low) + u * (scale(part.high) - scale(part.low))
    assert scale(part.at(u)) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(low=st.integers(-20, 20), size=st.integers(0, 5))
def test_integer_ranges_reach_every_value_equally(low, size):
    part = Range(low, low + size, "int")
    values = [part.at(u) for u in (np.arange(60) + 0.5) / 60]  # 60 = a multiple of 1 to 6
    assert {values.count(k) for k in range(low, low + size + 1)} == {60 // (size + 1)}


@given(bounds=BOUNDS, count=st.integers(2, 9))
def test_grids_are_equally_spaced(bounds, count):
    for kind, scale in (("uniform", np.asarray), ("log", np.log)):
        values = Range(*bounds, kind).grid(count).values
        assert len(values) == count
        steps = np.diff(scale(values))
        assert np.allclose(steps, steps.mean(), rtol=1e-6, atol=1e-9 * np.abs(scale(values)).max())
        assert (values[0], values[-1]) == pytest.approx(tuple(bounds))


@given(
    lists=st.lists(st.integers(1, 4), max_size=3),
    ranges=st.integers(0, 3),
    draws=st.integers(1, 5),
    more=st.integers(0, 4),
    seed=st.integers(0, 100),
)
def test_all_combinations_each_once_and_draws_that_stay(lists, ranges, draws, more, seed):
    space = {f"list{k}": Choices(tuple(range(n))) for k, n in enumerate(lists)}
    space |= {f"range{k}": Range(1.0, 2.0) for k in range(ranges)}
    settings = expand(space, draws, seed)
    assert len(settings) == np.prod(lists, dtype=int) * (draws if ranges else 1)
    assert len({tuple(setting.items()) for setting in settings}) == len(settings)
    assert all(tuple(setting) == tuple(space) for setting in settings)
    larger = expand(space, draws + more, seed)
    assert all(setting in larger for setting in settings)
    assert expand(space, draws, seed) == settings


def test_dimensions():
    assert parse_dimension('x=[1, [2, 3], "a"]') == ("x", Choices((1, [2, 3], "a")))
    assert parse_dimension("x=log(1e-9, 1e-3)") == ("x", Range(1e-9, 1e-3, "log"))
    assert parse_dimension("x = uniform(0,1,3)") == ("x", Choices((0.0, 0.5, 1.0)))
    assert parse_dimension("x=int(2,4,3)") == ("x", Choices((2, 3, 4)))


@pytest.mark.parametrize(
    "text",
    ["x", "x=3", "x=[]", "x=log(0,1)", "x=uniform(2,1)", "x=int(0.5,2)", "x=log(1,2,0)",
     "x=log(1)", "x=uniform(1,2,3,4)", "=[1]", "x=gauss(0,1)", "x=uniform(a,b)"],
)  # fmt: skip
def test_a_wrong_dimension_is_an_error(text):
    with pytest.raises(McmjError, match="expected"):
        parse_dimension(text)


def test_success_rates_by_setting_count_every_trial_once():
    space = {"a": Choices((1, [2, 3])), "b": Range(0.0, 1.0)}
    settings = expand(space, 9, seed=1)
    good = np.random.default_rng(0).random((len(settings), 4)) < 0.5
    table = success_by_setting(space, settings, good)
    for rows in table.values():
        assert sum(row["of"] for row in rows) == good.size
        assert sum(row["successes"] for row in rows) == good.sum()
    first = [k for k, setting in enumerate(settings) if setting["a"] == 1]
    assert table["a"][0]["successes"] == good[first].sum()
    bins = table["b"]
    assert [row["low"] for row in bins[1:]] > [row["high"] for row in bins[:-1]]
