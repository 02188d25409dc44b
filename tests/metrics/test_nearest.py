"""Distances to polygons against all vertices and all segments."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.metrics import orbits
from mcmj.metrics.gaits import delay_embedding
from mcmj.metrics.nearest import distances_to_curve, rows_within
from mcmj.targets.limit_cycles import from_array, target

seeds = st.integers(0, 2**32)


def brute_force(points, curve, *, closed):
    """Every vertex is looked at; of the segments, those that meet in the nearest."""
    found = []
    for point in points:
        at = int(np.linalg.norm(curve - point, axis=1).argmin())
        others = [(at - 1) % len(curve), (at + 1) % len(curve)]
        if not closed:
            others = [max(at - 1, 0), min(at + 1, len(curve) - 1)]
        feet = []
        for other in others:
            along = curve[other] - curve[at]
            share = along @ (point - curve[at]) / max(along @ along, 1e-300)
            feet.append(curve[at] + np.clip(share, 0, 1) * along)
        found.append(min(np.linalg.norm(point - foot) for foot in feet))
    return np.array(found)


@given(seed=seeds, size=st.integers(1, 700), width=st.integers(1, 8), closed=st.booleans())
def test_the_nearest_vertex_is_found_wherever_it_is(seed, size, width, closed):
    """Of vertices in no order, where boxes and neighbours are no help at all."""
    rng = np.random.default_rng(seed)
    points, curve = rng.normal(size=(40, width)), rng.normal(size=(size, width))
    found = distances_to_curve(points, curve, closed=closed)
    assert np.abs(found - brute_force(points, curve, closed=closed)).max() < 1e-14


@pytest.mark.parametrize("name", ["van_der_pol", "quadratic", "lissajous"])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 1.0])
def test_outputs_along_an_orbit(name, noise):
    """Also along one that crosses itself, and past its ends."""
    goal, rng = target(name), np.random.default_rng(0)
    outputs = goal.sample(np.arange(0, 3 * goal.period, 0.01))
    outputs = outputs + noise * rng.normal(size=outputs.shape)
    orbit = goal.orbit(orbits.ORBIT_POINTS)
    for points, curve, closed in ((outputs, orbit, True), (orbit, outputs, False)):
        found = distances_to_curve(points, curve, closed=closed)
        assert np.abs(found - brute_force(points, curve, closed=closed)).max() < 1e-14


def test_vertices_that_coincide():
    curve = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    assert distances_to_curve(np.array([[0.5, 2.0], [-3.0, 4.0]]), curve, closed=True) == (
        pytest.approx([2.0, 5.0])
    )
    assert distances_to_curve(np.array([[0.0, 3.0]]), curve[:1], closed=True) == pytest.approx([3])


@given(seed=seeds)
def test_rows_within_a_distance_are_counted_from_the_end(seed):
    rng = np.random.default_rng(seed)
    goal = delay_embedding(target("lissajous"))
    times = np.arange(0, 20, 0.05)
    size = np.geomspace(3.0, rng.uniform(0.001, 0.3), len(times))[:, None]
    points = goal.sample(times) + size * rng.normal(size=(len(times), 4))
    curve = goal.orbit(500)
    outside = np.flatnonzero(brute_force(points, curve, closed=True) > 0.1)
    wanted = len(points) - 1 - outside[-1] if outside.size else len(points)
    assert rows_within(points, curve, 0.1, 1) == wanted


def test_rows_that_are_all_within_and_none():
    goal = from_array("circle", np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]]), 1.0)
    curve = goal.orbit(100)
    assert rows_within(curve, curve, 1e-12, 1) == 100
    assert rows_within(curve + 5, curve, 1.0, 1) == 0
