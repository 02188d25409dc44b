"""random_body: its distribution's bounds, independent streams, and Delaunay edges."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj import random_body
from mcmj.core.random_body import BodySettings, delaunay_springs
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import PURPOSES, stream

seeds = st.integers(0, 2**40)
FIELDS = ("positions", "springs", "k1", "k3", "d1", "d3", "fixed", "w_in", "w_fb", "masses")
ROUNDING = 1e-15  # exp(log(x)) is off by a few units in the last place


def bounds():
    return st.tuples(st.floats(1e-3, 1e3), st.floats(1.0, 1e3)).map(lambda t: (t[0], t[0] * t[1]))


@given(
    seed=seeds, nodes=st.integers(3, 40), n_inputs=st.integers(0, 3), fraction=st.floats(0.01, 1)
)
def test_random_body_has_the_paper_s_properties(seed, nodes, n_inputs, fraction):
    body = random_body(
        seed, nodes, width=30.0, n_inputs=n_inputs, input_fraction=fraction, input_scale=2.5
    )
    x, y = body.positions.T
    assert body.n_nodes == nodes
    assert ((x >= 0) & (x <= 30.0) & (y >= 0) & (y <= 100.0)).all()
    assert set(np.flatnonzero(body.fixed)) == {x.argmin(), x.argmax()}
    a, b = body.springs.T
    assert body.rest_lengths == pytest.approx(np.hypot(x[b] - x[a], y[b] - y[a]), rel=1e-14)
    # Euler: a planar graph has at most 3 N - 6 edges; a triangulation at least 2 N - 3
    assert 2 * nodes - 3 <= body.n_springs <= max(3 * nodes - 6, 3)
    pushed = min(nodes - 2, max(1, round(fraction * nodes)))
    assert (np.count_nonzero(body.w_in, axis=0) == pushed).all()
    assert np.abs(body.w_in).max(initial=0.0) <= 2.5
    assert not body.w_in[body.fixed].any()
    assert not body.w_fb[body.fixed].any()


@given(seed=seeds, k1=bounds(), k3=bounds(), d1=bounds(), d3=bounds(), masses=bounds())
def test_parameters_stay_in_their_ranges(seed, **ranges):
    body = random_body(seed, 6, **ranges)
    for name, (low, high) in ranges.items():
        values = getattr(body, name)
        assert values.min() >= low * (1 - 10 * ROUNDING), name
        assert values.max() <= high * (1 + 10 * ROUNDING), name


def test_parameters_are_log_uniform():
    """Kolmogorov-Smirnov distance of log10(k1) from uniform: 5 % level is 1.36 / sqrt(n)."""
    body = random_body(3, 700, k1=(1e-2, 1e2))
    share = np.sort((np.log10(body.k1) + 2) / 4)
    n = len(share)
    distance = np.abs(share - (np.arange(n) + 0.5) / n).max() + 0.5 / n
    assert distance < 1.36 / np.sqrt(n)


@pytest.mark.parametrize(
    ("changes", "affected"),
    [
        ({"k1": (3.0, 7.0)}, {"k1"}),
        ({"k3": (1.0, 2.0)}, {"k3"}),
        ({"k3": (0.0, 0.0)}, {"k3"}),
        ({"d1": (1.0, 9.0)}, {"d1"}),
        ({"d3": (1.0, 9.0)}, {"d3"}),
        ({"masses": (0.5, 2.0)}, {"masses"}),
        ({"n_inputs": 2}, {"w_in"}),
        ({"n_outputs": 3}, {"w_fb"}),
        ({"feedback_scale": 1.0}, {"w_fb"}),
        ({"feedback_fraction": 0.5}, {"w_fb"}),
        ({"n_inputs": 2, "input_scale": 9.0}, {"w_in"}),
    ],
)
@pytest.mark.parametrize("seed", [0, 7])
def test_a_changed_setting_changes_nothing_else(seed, changes, affected):
    before, after = random_body(seed, 15), random_body(seed, 15, **changes)
    different = {
        name for name in FIELDS if not np.array_equal(getattr(before, name), getattr(after, name))
    }
    assert different == affected


@given(seed=seeds, few=st.integers(0, 3), more=st.integers(1, 3))
def test_added_channels_leave_earlier_weights_alone(seed, few, more):
    small = random_body(seed, 9, n_inputs=few, n_outputs=few)
    large = random_body(seed, 9, n_inputs=few + more, n_outputs=few + more)
    assert np.array_equal(large.w_in[:, :few], small.w_in)
    assert np.array_equal(large.w_fb[:, :few], small.w_fb)


@given(seed=seeds)
def test_same_seed_same_bits_and_another_seed_another_body(seed):
    assert random_body(seed, 10) == random_body(seed, 10)
    assert not np.array_equal(random_body(seed, 10).positions, random_body(seed + 1, 10).positions)


def test_streams_of_one_seed_are_all_different():
    draws = {purpose: stream(5, purpose).random(8) for purpose in PURPOSES}
    for one, other in combinations(draws, 2):
        assert not np.isin(draws[one], draws[other]).any(), (one, other)


def test_channels_of_a_body_have_different_weights():
    w_fb = random_body(0, 25, n_outputs=2, n_inputs=2)
    weights = np.hstack([w_fb.w_in, w_fb.w_fb])
    assert len({column.tobytes() for column in weights.T}) == 4


def test_bits_of_a_seed_do_not_change_between_versions():
    """Results of a seed must stay: NumPy promises the bits of PCG64 and SeedSequence."""
    assert stream(7, "topology").integers(2**32, size=2).tolist() == _by_hand(7, 0)
    assert stream(7, "feedback_weights").integers(2**32, size=2).tolist() == _by_hand(7, 7)


def _by_hand(seed, index):
    bits = np.random.PCG64(np.random.SeedSequence(seed).spawn(index + 1)[index])
    return np.random.Generator(bits).integers(2**32, size=2).tolist()


@given(seed=seeds, n=st.integers(3, 9))
def test_springs_are_the_edges_of_empty_circumcircles(seed, n):
    """The definition of Delaunay, by brute force over all triples of points."""
    points = np.random.default_rng(seed).random((n, 2))
    edges = set()
    for triple in combinations(range(n), 3):
        a, b, c = points[list(triple)]
        matrix = 2 * np.array([b - a, c - a])
        centre = np.linalg.solve(matrix, [b @ b - a @ a, c @ c - a @ a])
        others = np.delete(points, list(triple), axis=0)
        if (np.linalg.norm(others - centre, axis=1) > np.linalg.norm(a - centre)).all():
            edges |= set(combinations(triple, 2))
    assert {tuple(edge) for edge in delaunay_springs(points).tolist()} == edges


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0], [1, 1], [2, 2], [5, 5]],
        [[0, 3], [1, 3], [2, 3]],
        [[i * 0.1 + 7, i / 3 + 1] for i in range(6)],
        [[2, 2]] * 4,
    ],
)
def test_collinear_points_are_refused(points):
    with pytest.raises(InvalidArgumentError, match=r"^positions: .*collinear"):
        delaunay_springs(points)


def test_two_points_are_refused():
    with pytest.raises(InvalidArgumentError, match=r"^positions: expected at least 3 points"):
        delaunay_springs([[0, 0], [1, 1]])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("nodes", 2),
        ("nodes", 10.0),
        ("n_inputs", -1),
        ("n_outputs", True),
        ("width", 0.0),
        ("height", np.inf),
        ("k1", (0.0, 1.0)),
        ("k1", (2.0, 1.0)),
        ("d1", (1.0, np.nan)),
        ("k3", (0.0, 5.0)),
        ("d3", (-1.0, 5.0)),
        ("masses", (1.0, 2.0, 3.0)),
        ("input_fraction", 0.0),
        ("feedback_fraction", 1.5),
        ("feedback_scale", np.nan),
    ],
)
def test_bad_settings_are_refused_by_name(name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        random_body(0, **{name: value})
    assert caught.value.name == name


@pytest.mark.parametrize("seed", [-1, 1.5, "1", True])
def test_bad_seed(seed):
    with pytest.raises(InvalidArgumentError, match=r"^seed: expected an integer >= 0"):
        random_body(seed)


def test_unknown_setting_lists_the_names():
    with pytest.raises(UnknownNameError, match="'stiffness'") as caught:
        random_body(0, stiffness=(1, 2))
    assert set(caught.value.choices) == set(BodySettings.__dataclass_fields__)


def test_unknown_stream_lists_the_names():
    with pytest.raises(UnknownNameError, match="teacher_noise"):
        stream(0, "noise")
