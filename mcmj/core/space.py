"""What depends on how many dimensions a body has: positions, what pushes and what holds it."""

import numpy as np
import numpy.typing as npt

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array

AXES = "xyz"
UNIT = 8 * np.finfo(float).eps  # a vector as long as 1 to this is a unit vector already


def checked_positions(value: object) -> Array:
    """Distinct points (N, 2) or (N, 3), N >= 2.

    Raises:
        InvalidArgumentError: other shapes or numbers, or two points in one place.
    """
    positions = as_array("positions", value, (None, None))
    if positions.shape[1] not in (2, 3):
        raise InvalidArgumentError(
            "positions", "shape (any, 2) or (any, 3)", f"shape {positions.shape}"
        )
    if len(positions) < 2:
        raise InvalidArgumentError("positions", "at least 2 nodes", f"{len(positions)}")
    order = np.lexsort(positions.T)
    same = np.flatnonzero((np.diff(positions[order], axis=0) == 0).all(axis=1))
    if same.size:
        a, b = sorted(order[same[0] : same[0] + 2].tolist())
        raise InvalidArgumentError(
            "positions", "distinct points", f"nodes {a} and {b} both at {positions[a]}"
        )
    return positions


def checked_direction(value: object, dimensions: int) -> Array:
    """A unit vector (D,): what was given over its length; x of None.

    A vector that is one already, to rounding, stays as it is: done twice is done once.

    Raises:
        InvalidArgumentError: another shape, not finite, or 0.
    """
    wanted = np.eye(1, dimensions).ravel() if value is None else value
    given = as_array("direction", wanted, (dimensions,))
    largest = np.abs(given).max()
    if largest == 0.0:
        raise InvalidArgumentError("direction", "a vector that is not 0", given)
    if not 0.5 <= largest <= 1.0:
        given = given / largest  # now its length neither overflows nor underflows
    if abs(np.linalg.norm(given) - 1.0) > UNIT:
        given = given / np.linalg.norm(given)
    return given + 0.0  # no negative zeros


def held_nodes(positions: Array) -> npt.NDArray[np.bool_]:
    """Which nodes (N,) are fixed unless something else is said.

    The leftmost and the rightmost. In three dimensions a body held at two points turns freely
    about the line through them: there the node farthest from that line is held, too.
    """
    left, right = int(positions[:, 0].argmin()), int(positions[:, 0].argmax())
    fixed = np.zeros(len(positions), dtype=np.bool_)
    fixed[[left, right]] = True
    if positions.shape[1] == 3 and left != right:
        line = positions[right] - positions[left]
        moment = np.cross(positions - positions[left], line / np.linalg.norm(line))
        distance = np.where(fixed, -1.0, (moment**2).sum(axis=1))
        fixed[distance.argmax()] = True
    return fixed
