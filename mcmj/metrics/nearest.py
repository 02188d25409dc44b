"""Distances from points to a polygon: to the segments that meet in the nearest vertex. Compiled.

Vertices are in order along the curve, so boxes around LEAF consecutive ones, and around LEAF of
these boxes, are small; a box that is further than the nearest vertex so far is left out, as in a
tree (Friedman, Bentley and Finkel 1977). Points are in order too: the search for each begins at
the vertex that was nearest to the one before.
"""

import numpy as np
from numba import njit

from mcmj.utils.validation import Array

LEAF = 16


def distances_to_curve(points: Array, curve: Array, *, closed: bool) -> Array:
    """Distances (P,) of points (P, n) to a polygon (V, n).

    Args:
        closed: its last vertex is joined to its first.
    """
    found = np.empty(len(points))
    _all_distances(np.ascontiguousarray(points), *_boxed(curve), closed, found)
    return found


def rows_within(points: Array, curve: Array, distance: float, window: int) -> int:
    """How many of the last points (P, n) in a row are within a distance of a closed polygon.

    Args:
        distance: at most so much is the RMS one of as many points in a row as `window` says,
            whichever of the counted ones they are.
    """
    return int(_rows_within(np.ascontiguousarray(points), *_boxed(curve), distance, window))


def _boxed(curve: Array) -> tuple[Array, Array, Array]:
    """The curve, the boxes of its vertices and theirs: lowest and highest corners, (2, B, n)."""
    curve = np.ascontiguousarray(curve)
    firsts = np.arange(0, len(curve), LEAF)
    small = np.stack([np.minimum.reduceat(curve, firsts), np.maximum.reduceat(curve, firsts)])
    firsts = np.arange(0, len(firsts), LEAF)
    low, high = np.minimum.reduceat(small[0], firsts), np.maximum.reduceat(small[1], firsts)
    return curve, small, np.stack([low, high])


@njit(cache=True, nogil=True, error_model="numpy")
def _all_distances(points, curve, small, large, closed, found):
    at = 0
    for k in range(len(points)):
        at = _nearest(points[k], curve, small, large, _walk(points[k], curve, at))
        found[k] = _to_sides(points[k], curve, at, closed)


@njit(cache=True, nogil=True, error_model="numpy")
def _rows_within(points, curve, small, large, distance, window):
    at, count, total = 0, len(points), 0.0
    squares = np.empty(count)
    for k in range(count):
        point = points[count - 1 - k]
        at = _nearest(point, curve, small, large, _walk(point, curve, at))
        squares[k] = _to_sides(point, curve, at, True) ** 2
        total += squares[k]
        if k >= window:
            total -= squares[k - window]
        if k >= window - 1 and not total <= window * distance**2:
            return k
    return count


@njit(inline="always")
def _squared(point, vertex):
    total = 0.0
    for c in range(point.size):
        total += (point[c] - vertex[c]) ** 2
    return total


@njit(inline="always")
def _to_box(point, boxes, b):
    """Squared distance to a box."""
    total = 0.0
    for c in range(point.size):
        total += max(boxes[0, b, c] - point[c], point[c] - boxes[1, b, c], 0.0) ** 2
    return total


@njit(cache=True, nogil=True)
def _walk(point, curve, at):
    """The vertex that is nearer than both its neighbours, downhill from a first one."""
    best, count = _squared(point, curve[at]), len(curve)
    for way in (1, -1):
        while True:
            other = (at + way) % count
            distance = _squared(point, curve[other])
            if not distance < best:
                break
            at, best = other, distance
    return at


@njit(cache=True, nogil=True)
def _nearest(point, curve, small, large, at):
    """The nearest vertex; `at` is a guess."""
    best = _squared(point, curve[at])
    for b in range(large.shape[1]):
        if _to_box(point, large, b) >= best:
            continue
        for s in range(LEAF * b, min(LEAF * (b + 1), small.shape[1])):
            if _to_box(point, small, s) >= best:
                continue
            for v in range(LEAF * s, min(LEAF * (s + 1), len(curve))):
                distance = _squared(point, curve[v])
                if distance < best:
                    at, best = v, distance
    return at


@njit(cache=True, nogil=True, error_model="numpy")
def _to_sides(point, curve, at, closed):
    """Distance to the nearer of the segments that meet in a vertex."""
    last, best = len(curve) - 1, np.inf
    for way in (-1, 1):
        other = at + way
        if other < 0:
            other = last if closed else 0
        elif other > last:
            other = 0 if closed else last
        start, squared, inner = curve[at], 0.0, 0.0
        for c in range(point.size):
            along = curve[other, c] - start[c]
            squared += along**2
            inner += (point[c] - start[c]) * along
        share = min(max(inner / squared, 0.0), 1.0) if squared > 0.0 else 0.0
        total = 0.0
        for c in range(point.size):
            total += (point[c] - start[c] - share * (curve[other, c] - start[c])) ** 2
        best = min(best, total)
    return np.sqrt(best)
