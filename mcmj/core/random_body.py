"""Random bodies as in the paper, or in space: uniform points, Delaunay springs, log-uniform
parameters."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay, QhullError

from mcmj.core.body import Body
from mcmj.core.space import held_nodes
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, as_array, require_count, require_number, require_range

Range = tuple[float, float]
# by dimensions: the fewest points, what they must span, and do not, and Qhull's options: SciPy's
# own in the plane; in space without Qz, which adds a point at infinity, and so takes five
SIMPLICES: dict[int, tuple[int, str, str, str | None]] = {
    2: (3, "plane", "collinear", None),
    3: (5, "space", "coplanar", "Qbb Qc Q12"),
}
MOST_NODES, MOST_CHANNELS = 100_000, 1000  # more would fill the memory before anything runs


@dataclass(frozen=True)
class BodySettings:
    """What a random body is drawn from.

    The defaults are the ranges of the authors' toolbox but for d1, three times larger, which
    was chosen by success rate (README).

    Attributes:
        nodes: number of masses N.
        width: of the area of the nodes [m].
        height: of the area of the nodes [m].
        depth: of the box of the nodes [m]; 0: a planar body.
        k1: (low, high) of the log-uniform linear stiffnesses [N/m].
        k3: (low, high) of the log-uniform cubic stiffnesses [N/m^3]; 0 0: linear springs.
        d1: (low, high) of the log-uniform linear dampings [N s/m].
        d3: (low, high) of the log-uniform cubic dampings [N s^3/m^3]; 0 0: linear dampers.
        masses: (low, high) of the log-uniform masses [kg].
        n_inputs: number of input channels.
        input_fraction: share of the nodes that an input pushes.
        input_scale: input weights are uniform in +-scale [N].
        n_outputs: number of feedback channels.
        feedback_fraction: share of the nodes that an output pushes.
        feedback_scale: feedback weights are uniform in +-scale [N].

    Raises:
        InvalidArgumentError: a range or number out of bounds.
    """

    nodes: int = 25
    width: float = 100.0
    height: float = 100.0
    depth: float = 0.0
    k1: Range = (1.0, 10.0)
    k3: Range = (100.0, 200.0)
    d1: Range = (0.3, 6.0)
    d3: Range = (100.0, 200.0)
    masses: Range = (1.0, 1.0)
    n_inputs: int = 0
    input_fraction: float = 0.2
    input_scale: float = 1.0
    n_outputs: int = 2
    feedback_fraction: float = 0.2
    feedback_scale: float = 10.0

    def __post_init__(self) -> None:
        require_number("depth", self.depth, 0.0)
        require_count("nodes", self.nodes, SIMPLICES[3 if self.depth else 2][0], MOST_NODES)
        require_count("n_inputs", self.n_inputs, 0, MOST_CHANNELS)
        require_count("n_outputs", self.n_outputs, 0, MOST_CHANNELS)
        for name in ("width", "height", "input_scale", "feedback_scale"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        for name in ("input_fraction", "feedback_fraction"):
            require_number(name, getattr(self, name), 0.0, 1.0, open_low=True)
        for name in ("k1", "k3", "d1", "d3", "masses"):
            bounds = getattr(self, name)
            if name in ("k3", "d3") and tuple(bounds) == (0.0, 0.0):
                continue  # switches the cubic term off
            require_range(name, bounds)


def random_body(seed: int, nodes: int = 25, **settings: Any) -> Body:
    """Draw a random body (Hauser et al. 2012, section 4).

    Nodes are uniform in the area, springs are the edges of their Delaunay triangulation, rest
    lengths the distances at the start; the leftmost and the rightmost node are fixed. With a
    `depth` they fill a box: the springs are the edges of Delaunay's tetrahedra, and a third node
    is fixed, see `mcmj.core.space.held_nodes`. Every
    quantity has its own random stream: changing one range leaves all else alone, and adding a
    channel leaves the earlier channels alone.

    Args:
        seed: integer >= 0; the same seed and settings give the same bits.
        nodes: number of masses N.
        settings: fields of BodySettings.

    Raises:
        InvalidArgumentError: a range or number out of bounds.
        UnknownNameError: a setting that does not exist.
    """
    for name in settings:
        if name not in BodySettings.__dataclass_fields__:
            raise UnknownNameError("body setting", name, BodySettings.__dataclass_fields__)
    return draw_body(seed, BodySettings(nodes=nodes, **settings))


def draw_body(seed: int, settings: BodySettings) -> Body:
    """`random_body` from a settings object."""
    n, size = settings.nodes, [settings.width, settings.height]
    if settings.depth:
        size.append(settings.depth)
    positions = stream(seed, "topology").uniform(np.zeros(len(size)), size, (n, len(size)))
    springs = delaunay_springs(positions)
    fixed = held_nodes(positions)
    free = np.flatnonzero(~fixed)
    parameters = {
        name: log_uniform(stream(seed, name), getattr(settings, name), len(springs))
        for name in ("k1", "k3", "d1", "d3")
    }
    return Body(
        positions=positions,
        springs=springs,
        fixed=fixed,
        masses=log_uniform(stream(seed, "masses"), settings.masses, n),
        w_in=_channel_weights(
            stream(seed, "input_weights"),
            (n, settings.n_inputs),
            free,
            settings.input_fraction,
            settings.input_scale,
        ),
        w_fb=_channel_weights(
            stream(seed, "feedback_weights"),
            (n, settings.n_outputs),
            free,
            settings.feedback_fraction,
            settings.feedback_scale,
        ),
        **parameters,
    )


def delaunay_springs(positions: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Edges (L, 2) of the Delaunay triangulation of (N, D) points, each once, sorted.

    Raises:
        InvalidArgumentError: fewer than 3 points in the plane or 5 in space, or all on one line
            or plane.
    """
    points = as_array("positions", positions, (None, None))
    dimensions = points.shape[1]
    if dimensions not in SIMPLICES:
        raise InvalidArgumentError("positions", "points (N, 2) or (N, 3)", points.shape)
    least, kind, flat, options = SIMPLICES[dimensions]
    if len(points) < least:
        raise InvalidArgumentError("positions", f"at least {least} points", len(points))
    try:
        corners = Delaunay(points, qhull_options=options).simplices
    except QhullError as error:
        raise InvalidArgumentError(
            "positions", f"points that span a {kind}", f"{len(points)} {flat} points"
        ) from error
    edges = np.concatenate([corners[:, pair] for pair in combinations(range(dimensions + 1), 2)])
    found = np.unique(np.sort(edges, axis=1), axis=0).astype(np.int64)
    assert found.max() < len(points)
    return found


def log_uniform(rng: np.random.Generator, bounds: Range, size: int) -> Array:
    """Numbers (size,) whose logarithms are uniform between those of the bounds."""
    low, high = bounds
    if low == high:
        return np.full(size, float(low))
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def _channel_weights(
    rng: np.random.Generator,
    shape: tuple[int, int],
    free: npt.NDArray[np.int64],
    fraction: float,
    scale: float,
) -> Array:
    """Weights (nodes, channels): each channel pushes max(1, round(fraction * nodes)) nodes."""
    nodes, channels = shape
    weights = np.zeros(shape)
    pushed = min(len(free), max(1, round(fraction * nodes)))
    for channel, child in enumerate(rng.spawn(channels)):
        chosen = child.choice(free, pushed, replace=False)
        weights[chosen, channel] = child.uniform(-scale, scale, pushed)
    return weights
