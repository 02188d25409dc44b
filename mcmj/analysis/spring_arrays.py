"""Arrays of independent springs on one wall, pushed by one input (Hauser et al. 2012, app. E).

    m x_i'' = -k_i x_i - d_i x_i' + u,        x = (x_1, x_1', x_2, x_2', ...),  x' = A x + b u

Its controllability matrix R = [b, A b, ..., A^(2n-1) b] has rank 2 n, as feedback
linearisation needs, only if no two springs have the same characteristic polynomial: in units
with m = 1, det R is, up to its sign, the product over pairs i < j of

    (k_i - k_j)^2 + (d_i - d_j) (d_i k_j - d_j k_i)
"""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_above, require_count, require_number

WALL = 100.0  # m: rest length of the first spring, far more than any elongation here


@dataclass(frozen=True)
class LinearArray:
    """n linear springs side by side.

    Attributes:
        k: (n,) stiffnesses [N/m].
        d: (n,) dampings [N s/m].
        mass: of every node [kg].

    Raises:
        InvalidArgumentError: wrong shapes, or numbers that are not positive.
    """

    k: Array
    d: Array
    mass: float = 1.0

    def __post_init__(self) -> None:
        k = as_array("k", self.k, (None,))
        for name, array in (("k", k), ("d", as_array("d", self.d, k.shape))):
            require_above(name, array, 0.0)
            object.__setattr__(self, name, array)
        require_number("mass", self.mass, 0.0, open_low=True)

    @property
    def time_unit(self) -> float:
        """sqrt(m / mean k) [s]: conditioning is that of the array in this unit."""
        return float(np.sqrt(self.mass / self.k.mean()))

    def state_space(self, time_unit: float = 1.0) -> tuple[Array, Array]:
        """A (2n, 2n) and b (2n,) of x' = A x + b u, with time in units of `time_unit` [s]."""
        n = len(self.k)
        a, b = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        even, odd = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
        a[even, odd] = 1.0
        a[odd, even] = -self.k / self.mass * time_unit**2
        a[odd, odd] = -self.d / self.mass * time_unit
        b[odd] = time_unit**2 / self.mass
        return a, b

    def controllability(self) -> Array:
        """R (2n, 2n) in the array's own unit of time, columns scaled to unit length.

        Neither changes the rank; without them the condition number would be that of the units.
        """
        a, b = self.state_space(self.time_unit)
        columns = [b]
        for _ in range(len(b) - 1):
            columns.append(a @ columns[-1])
        return np.column_stack([c / np.linalg.norm(c) for c in columns])

    def body(self) -> Body:
        """The array as a body: one wall node, all masses on one line, which they never leave.

        Spring i reaches from the wall to a mass at WALL + i along x. The masses move along x
        only and pass each other freely, so that Eq. (6) is exactly the array's.
        """
        n = len(self.k)
        return parallel_body(self.k, np.zeros(n), self.d, np.zeros(n), masses=self.mass)


def parallel_body(k1: Array, k3: Array, d1: Array, d3: Array, *, masses: float = 1.0) -> Body:
    """Independent nonlinear springs (n,) on one wall, one mass each, all pushed by one input."""
    n = len(k1)
    x = np.concatenate([[0.0], WALL + np.arange(n)])
    wall = x == 0.0
    return Body(
        positions=np.column_stack([x, np.zeros(n + 1)]),
        springs=np.column_stack([np.zeros(n, np.int64), np.arange(1, n + 1)]),
        k1=k1, k3=k3, d1=d1, d3=d3,
        fixed=wall, w_in=np.where(wall, 0.0, 1.0)[:, None], masses=np.full(n + 1, masses),
    )  # fmt: skip


def diverse_array(
    masses: int, diversity: float, *, stiffness: float, damping: float
) -> LinearArray:
    """Stiffnesses spread evenly in log k over stiffness x exp(+-diversity); equal dampings.

    Raises:
        InvalidArgumentError: not at least one mass, or a negative diversity.
    """
    require_count("masses", masses, 1)
    require_number("diversity", diversity, 0.0, 50.0)
    for name, value in (("stiffness", stiffness), ("damping", damping)):
        require_number(name, value, 0.0, open_low=True)
    spread = np.linspace(-1.0, 1.0, masses) if masses > 1 else np.zeros(1)
    return LinearArray(stiffness * np.exp(diversity * spread), np.full(masses, damping))


def numerical_rank(matrix: Array) -> int:
    """Singular values above the rounding error of the largest, as numpy.linalg.matrix_rank.

    Raises:
        InvalidArgumentError: not a matrix.
    """
    if np.ndim(matrix) != 2:
        raise InvalidArgumentError("matrix", "two axes", np.ndim(matrix))
    return int(np.linalg.matrix_rank(matrix))
