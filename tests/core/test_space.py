"""Bodies in space: random ones, what pushes and holds them, and what is refused."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spatial import space_body

import mcmj
from mcmj.core.body import require_plane, spring_lengths
from mcmj.core.random_body import delaunay_springs
from mcmj.core.space import checked_direction, held_nodes
from mcmj.utils.errors import InvalidArgumentError

seeds = st.integers(0, 2**32)


def test_a_body_says_where_it_lives():
    body, flat = mcmj.random_body(0, 20, depth=50.0), mcmj.random_body(0, 20)
    assert (body.dimensions, flat.dimensions) == (3, 2)
    assert "in space" in repr(body)
    assert "in space" not in repr(flat)
    assert np.array_equal(body.direction, [1, 0, 0])
    assert np.array_equal(flat.direction, [1, 0])
    ends = body.positions[body.springs]
    assert np.array_equal(body.rest_lengths, np.sqrt(((ends[:, 1] - ends[:, 0]) ** 2).sum(1)))
    assert body.rest_lengths == pytest.approx(spring_lengths(body.positions, body.springs))


@given(seed=seeds, n=st.integers(5, 9))
def test_springs_are_the_edges_of_empty_circumspheres(seed, n):
    """The definition of Delaunay, by brute force over all sets of four points."""
    points = np.random.default_rng(seed).random((n, 3))
    edges = set()
    for four in combinations(range(n), 4):
        a, *others = points[list(four)]
        centre = np.linalg.solve(2 * (others - a), [b @ b - a @ a for b in others])
        rest = np.delete(points, list(four), axis=0)
        if (np.linalg.norm(rest - centre, axis=1) > np.linalg.norm(a - centre)).all():
            edges |= set(combinations(four, 2))
    assert {tuple(edge) for edge in delaunay_springs(points).tolist()} == edges


@given(seed=seeds, nodes=st.integers(5, 60), depth=st.sampled_from([1e-3, 1.0, 100.0, 1e5]))
def test_random_bodies_fill_their_box_and_are_held_rigidly(seed, nodes, depth):
    body = mcmj.random_body(seed, nodes, depth=depth)
    assert body == mcmj.random_body(seed, nodes, depth=depth)
    assert (body.positions >= 0).all()
    assert (body.positions <= [100, 100, depth]).all()
    assert body.springs.max() < nodes
    assert set(body.springs.ravel()) == set(range(nodes))
    assert body.fixed.sum() == 3
    x = body.positions[:, 0]
    assert body.fixed[[x.argmin(), x.argmax()]].all()
    if depth >= 1.0:  # no motion of first order keeps all lengths
        ends = body.positions[body.springs]
        axis = (ends[:, 1] - ends[:, 0]) / body.rest_lengths[:, None]
        rows = np.zeros((body.n_springs, nodes, 3))
        springs = np.arange(body.n_springs)
        rows[springs, body.springs[:, 0]], rows[springs, body.springs[:, 1]] = -axis, axis
        motions = rows[:, body.free].reshape(body.n_springs, -1)
        assert np.linalg.matrix_rank(motions) == 3 * len(body.free)


def test_the_planar_draws_do_not_know_of_a_depth():
    flat, deep = mcmj.random_body(3, 12), mcmj.random_body(3, 12, depth=1.0)
    assert flat.dimensions == 2
    assert not np.array_equal(flat.positions, deep.positions[:, :2])


@pytest.mark.parametrize("depth", [-1.0, np.inf, True])
def test_a_bad_depth_is_refused(depth):
    with pytest.raises(InvalidArgumentError, match=r"^depth: "):
        mcmj.random_body(0, depth=depth)


def test_points_that_span_no_space_are_refused():
    with pytest.raises(InvalidArgumentError, match="coplanar"):
        delaunay_springs(np.column_stack([np.random.default_rng(0).random((6, 2)), np.ones(6)]))
    with pytest.raises(InvalidArgumentError, match="at least 5 points"):
        delaunay_springs(np.eye(4, 3))
    with pytest.raises(InvalidArgumentError, match=r"^nodes: "):
        mcmj.random_body(0, nodes=4, depth=1.0)


def test_the_third_fixed_node_is_the_farthest_from_the_line_of_the_others():
    positions = np.array([[0.0, 0, 0], [9, 0, 0], [4, 1, 1], [5, 0, -2], [1, 1, 0]])
    assert held_nodes(positions).tolist() == [True, True, False, True, False]
    assert held_nodes(positions[:, :2]).tolist() == [True, True, False, False, False]


@given(
    vector=st.lists(st.floats(-1e300, 1e300), min_size=3, max_size=3).filter(any),
    dimensions=st.sampled_from([2, 3]),
)
def test_a_direction_is_a_unit_vector_and_one_done_twice_is_the_same(vector, dimensions):
    if not any(vector[:dimensions]):
        return
    once = checked_direction(vector[:dimensions], dimensions)
    assert abs(np.hypot.reduce(once) - 1.0) < 2e-15
    longest = np.abs(vector[:dimensions]).argmax()
    assert once[longest] * vector[longest] > 0
    twice = checked_direction(once, dimensions)
    assert twice.tobytes() == once.tobytes()


def test_what_is_planar_only_names_the_body():
    require_plane(mcmj.random_body(0, 5), "this")
    with pytest.raises(InvalidArgumentError, match=r"^body: expected a planar one for this") as one:
        require_plane(space_body(), "this")
    with pytest.raises(InvalidArgumentError, match=r"^body: expected one pushed along x") as two:
        require_plane(replace(mcmj.random_body(0, 5), direction=[0, 1]), "this")
    assert one.value.name == two.value.name == "body"
