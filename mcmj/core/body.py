"""A compliant body: point masses in the plane or in space, joined by nonlinear springs.

The body is the reservoir. Its physics (Hauser et al. 2012, Eqs. 6 and 7), for node i
and spring j with x1 = l - l0 and x2 = dl/dt:

    m_i p_i'' = F_i + (w_in[i] . u + w_fb[i] . y) e
    pull_j    = k1 x1 + k3 x1^3 + d1 x2 + d3 x2^3      along the spring's axis

F are the pulls of the node's springs; e is `direction`, x in the paper.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mcmj.core.space import checked_direction, checked_positions, held_nodes
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_above


@dataclass(frozen=True, eq=False)
class Body:
    """Masses, springs and channels of a body; every array is checked, then read-only.

    Attributes:
        positions: (N, D) start positions [m], D = 2 or 3; the body starts there, at rest.
        springs: (L, 2) node indices of each spring's ends.
        k1, k3: (L,) linear [N/m] and cubic [N/m^3] stiffness, k1 > 0, k3 >= 0.
        d1, d3: (L,) linear [N s/m] and cubic [N s^3/m^3] damping, d1 > 0, d3 >= 0.
        rest_lengths: (L,) l0 [m]; default: the distances at the start.
        fixed: (N,) bool; default: the leftmost and the rightmost node, and in three dimensions
            the node farthest from the line through them, about which the body would turn.
        w_in: (N, n_inputs) force along `direction` on each node per unit input [N]; default: none.
        w_fb: (N, n_outputs) the same per unit output [N]; default: none.
        masses: (N,) [kg]; default: 1. Weights and masses of fixed nodes have no effect.
        direction: (D,) unit vector along which inputs, feedback and a rollout's forces act; of
            any other length when given; default: x.

    Raises:
        InvalidArgumentError: wrong shape, NaN, an index out of range, a spring that joins a
            node to itself or doubles another, coincident nodes, a body in several pieces, or
            k1, d1, rest length or mass that is not positive, or direction 0.
    """

    positions: Array
    springs: npt.NDArray[np.int64]
    k1: Array
    k3: Array
    d1: Array
    d3: Array
    rest_lengths: Array = None  # type: ignore[assignment]  # None becomes an array on construction
    fixed: npt.NDArray[np.bool_] = None  # type: ignore[assignment]  # so do these
    w_in: Array = None  # type: ignore[assignment]
    w_fb: Array = None  # type: ignore[assignment]
    masses: Array = None  # type: ignore[assignment]
    direction: Array = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        positions = checked_positions(self.positions)
        springs = _checked_springs(self.springs, positions)
        n, n_springs = len(positions), len(springs)
        arrays: dict[str, npt.NDArray[Any]] = {"positions": positions, "springs": springs}
        for name in ("k1", "k3", "d1", "d3"):
            arrays[name] = as_array(name, getattr(self, name), (n_springs,))
            require_above(name, arrays[name], 0.0, strict=name in ("k1", "d1"))
        arrays["rest_lengths"] = (
            spring_lengths(positions, springs)
            if self.rest_lengths is None
            else as_array("rest_lengths", self.rest_lengths, (n_springs,))
        )
        require_above("rest_lengths", arrays["rest_lengths"], 0.0)
        arrays["fixed"] = _checked_fixed(self.fixed, positions)
        arrays["masses"] = (
            np.ones(n) if self.masses is None else as_array("masses", self.masses, (n,))
        )
        require_above("masses", arrays["masses"], 0.0)
        arrays["direction"] = checked_direction(self.direction, positions.shape[1])
        for name in ("w_in", "w_fb"):
            given = getattr(self, name)
            arrays[name] = np.zeros((n, 0)) if given is None else as_array(name, given, (n, None))
            arrays[name] = arrays[name] + 0.0  # no negative zeros: a file keeps only what pushes
        for name, array in arrays.items():
            frozen = array.copy()
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    def __eq__(self, other: object) -> bool:
        """Bodies are equal when all their arrays are, bits included."""
        if not isinstance(other, Body):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    __hash__ = None  # type: ignore[assignment]  # Python's way to say: not hashable

    def __reduce__(self) -> tuple[type["Body"], tuple[npt.NDArray[Any], ...]]:
        """Copies and what is unpickled come from the constructor: checked, and read-only."""
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    @property
    def n_nodes(self) -> int:
        """N."""
        return len(self.positions)

    @property
    def dimensions(self) -> int:
        """D, 2 or 3."""
        return int(self.positions.shape[1])

    @property
    def pushed_along_x(self) -> bool:
        """Whether inputs, feedback and forces act along x."""
        return bool(self.direction[0] == 1.0 and not self.direction[1:].any())

    @property
    def n_springs(self) -> int:
        """L."""
        return len(self.springs)

    @property
    def n_forces(self) -> int:
        """Number of forces of a rollout, one a node: N."""
        return self.n_nodes

    @property
    def n_inputs(self) -> int:
        """Number of input channels."""
        return int(self.w_in.shape[1])

    @property
    def n_outputs(self) -> int:
        """Number of outputs, each fed back by a channel."""
        return int(self.w_fb.shape[1])

    @property
    def free(self) -> npt.NDArray[np.int64]:
        """Indices of the nodes that can move."""
        return np.flatnonzero(~self.fixed)

    def __repr__(self) -> str:
        space = "" if self.dimensions == 2 else " in space"
        return (
            f"Body({self.n_nodes} nodes{space}, {self.n_springs} springs, "
            f"{int(self.fixed.sum())} fixed, {self.n_inputs} inputs, {self.n_outputs} outputs)"
        )


def spring_lengths(positions: Array, springs: npt.NDArray[np.int64]) -> Array:
    """Lengths |p_b - p_a| (..., L) [m] of springs (a, b) at positions (..., N, D)."""
    ends = positions[..., springs, :]
    found: Array = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
    return found


def damper_reach(body: Body) -> Array:
    """r (L,) [1/kg]: over a spring's free ends, the sum of their numbers of springs / mass.

    No motion of the body is damped faster than max_j r_j q'(x2_j), whatever its shape: row sums
    bound the eigenvalues of M^-1 D, D = sum_j q'(x2_j) J_j^T J_j with |J_j| = 1 at either end.
    """
    springs_of = np.bincount(body.springs.ravel(), minlength=body.n_nodes)
    found: Array = np.where(body.fixed, 0.0, springs_of / body.masses)[body.springs].sum(axis=1)
    return found


def require_plane(body: Body, what: str) -> None:
    """Raise unless a body is planar and pushed along x, which is all that `what` knows.

    Raises:
        InvalidArgumentError: names the body, and says what it is.
    """
    if body.dimensions != 2:
        raise InvalidArgumentError("body", f"a planar one for {what}", f"{body!r}")
    if not body.pushed_along_x:
        got = f"one pushed along {body.direction}"
        raise InvalidArgumentError("body", f"one pushed along x for {what}", got)


def _checked_springs(value: object, positions: Array) -> npt.NDArray[np.int64]:
    given = as_array("springs", value, (None, 2))
    springs = given.astype(np.int64)
    n = len(positions)
    bad = np.flatnonzero((springs != given).any(axis=1) | ((given < 0) | (given >= n)).any(axis=1))
    if bad.size:
        raise InvalidArgumentError(
            "springs", f"node indices from 0 to {n - 1}", f"{given[bad[0]]} for spring {bad[0]}"
        )
    loops = np.flatnonzero(springs[:, 0] == springs[:, 1])
    if loops.size:
        raise InvalidArgumentError(
            "springs", "two different nodes each", f"spring {loops[0]} from a node to itself"
        )
    pairs, counts = np.unique(np.sort(springs, axis=1), axis=0, return_counts=True)
    if (counts > 1).any():
        raise InvalidArgumentError(
            "springs", "one spring per pair of nodes", f"several between {pairs[counts > 1][0]}"
        )
    _check_connected(springs, n)
    return springs


def _check_connected(springs: npt.NDArray[np.int64], n: int) -> None:
    graph = coo_array((np.ones(len(springs)), (springs[:, 0], springs[:, 1])), shape=(n, n))
    pieces, label = connected_components(graph, directed=False)
    if pieces > 1:
        apart = np.flatnonzero(label != label[0])[0]
        raise InvalidArgumentError(
            "springs",
            "a connected body",
            f"{pieces} pieces: no path of springs from node 0 to node {apart}",
        )


def _checked_fixed(value: object, positions: Array) -> npt.NDArray[np.bool_]:
    n = len(positions)
    if value is None:
        array = held_nodes(positions)
    else:
        array = np.asarray(value)
        if array.dtype != np.bool_ or array.shape != (n,):
            raise InvalidArgumentError(
                "fixed", f"{n} booleans", f"{array.dtype} of shape {array.shape}"
            )
    if array.all():
        raise InvalidArgumentError("fixed", "at least one free node", "all nodes fixed")
    return array
