"""Paths into metrics: the one notation of searches and of the reproduction."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.metrics.metric_paths import matched, numbers_at, quantity
from mcmj.utils.errors import UnknownNameError

METRICS = {
    "eps": {"0.2": {"orbit_error": 0.1, "rounds": 3}, "5": {"orbit_error": None}},
    "total": 2,
    "times": [1.0, None, 3.0],
    "bodies": [{"error": 0.5}, {"name": "x"}],
    "ok": True,
    "none": {},
}


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("total", {"total": 2.0}),
        ("eps/0.2/orbit_error", {"eps/0.2/orbit_error": 0.1}),
        ("eps/*/orbit_error", {"eps/0.2/orbit_error": 0.1, "eps/5/orbit_error": None}),
        ("times/*", {"times/0": 1.0, "times/1": None, "times/2": 3.0}),
        ("times/2", {"times/2": 3.0}),
        ("bodies/*/error", {"bodies/0/error": 0.5}),
        ("*", {"total": 2.0}),
        ("*/*/*", {"eps/0.2/orbit_error": 0.1, "eps/0.2/rounds": 3.0, "eps/5/orbit_error": None,
                   "bodies/0/error": 0.5}),
    ],
)  # fmt: skip
def test_numbers_by_path(path, found):
    assert numbers_at(METRICS, path) == found


@pytest.mark.parametrize(
    "path", ["eps.0.2.orbit_error", "eps/0.2", "times", "times/3", "times/-1", "ok", "total/x",
             "bodies/1/name", "none/*", "", "/total"],
)  # fmt: skip
def test_a_path_to_no_number_is_named_and_the_others_listed(path):
    with pytest.raises(UnknownNameError) as caught:
        numbers_at(METRICS, path)
    assert str(caught.value) == (
        f"unknown number of the metrics {path!r}; valid choices: bodies/*/error, "
        "eps/0.2/orbit_error, eps/0.2/rounds, eps/5/orbit_error, times/*, total"
    )


KEYS = st.text(st.characters(codec="utf-8", exclude_characters="/"), max_size=4)
TREES = st.recursive(
    st.floats(allow_nan=False, allow_infinity=False) | st.none() | st.text(max_size=2),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=12,
)


@given(metrics=st.dictionaries(KEYS, TREES, max_size=4))
def test_every_path_in_the_message_leads_to_numbers_and_no_number_is_left_out(metrics):
    metrics = json.loads(json.dumps(metrics))
    with pytest.raises(UnknownNameError) as caught:
        numbers_at(metrics, "/".join(["x"] * 99))
    listed = {path for choice in caught.value.choices for path in numbers_at(metrics, choice)}
    assert listed == {path for depth in range(1, 13) for path in found(metrics, depth)}


def found(metrics, depth):
    try:
        return numbers_at(metrics, "/".join("*" * depth))
    except UnknownNameError:
        return {}


def test_names_for_people():
    assert matched("eps/0.2/orbit_error", "eps/*/orbit_error") == "0.2"
    assert matched("a/b/c", "*/b/*") == "a/c"
    assert matched("a/b", "a/b") == "a/b"
    assert quantity("eps/*/orbit_error") == "orbit error"
    assert quantity("worst_error/*") == "worst error"
    assert quantity("*") == "number"
