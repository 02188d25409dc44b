"""Floquet multipliers of a loop's cycle and of the system it was taught.

The multipliers are the eigenvalues of the monodromy matrix D phi_T at a point of the cycle,
phi_T the flow map over one period. One is 1, of a shift along the cycle; the cycle is stable
if all others are smaller in magnitude (Guckenheimer and Holmes 1983, section 1.5).
`multipliers_of` takes any loop; `floquet` adds the linearised step map, of planar bodies only.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from mcmj.analysis.loops.loop_map import LoopMap
from mcmj.analysis.stability.cycle import Cycle, flow_map
from mcmj.analysis.stability.loop import ClosedLoop
from mcmj.analysis.stability.variational import variational
from mcmj.targets.limit_cycles import ATOL, RTOL, Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_number

Complex = npt.NDArray[np.complex128]

# Of a cycle's size. Central differences are off by about eps^2 (truncation) and by
# 1e-12 / eps (rounding: 1e-14 m in positions of 100 m, cycles of 0.05 m): least near 1e-4;
# tests/test_stability.py shows the plateau.
DIFFERENCE = 1e-4


NEUTRAL = 1e-3  # multipliers as near to 1: a double one of 1 splits by the root of an error


@dataclass(frozen=True)
class Multipliers:
    """Multipliers by differences.

    Attributes:
        multipliers: (n,) by differences, largest first, the phase's (nearest to 1) ahead.
        phase_error: |D phi_T t - t| / |t|, t the tangent: how exactly the phase is neutral.
        monodromy: (n, n) by differences.
        leading_vector: (n,) eigenvector of the leading nontrivial multiplier.
    """

    multipliers: Complex
    phase_error: float
    monodromy: Array
    leading_vector: Complex

    @property
    def phase(self) -> float:
        """|multiplier| of a shift along the cycle: 1."""
        return float(abs(self.multipliers[0]))

    @property
    def leading_nontrivial(self) -> float:
        """Largest magnitude but for the phase's; below 1 the cycle is stable."""
        return float(abs(self.multipliers[1]))

    @property
    def transverse(self) -> Complex:
        """(n - neutral,): multipliers that are not neutral, largest first."""
        return self.multipliers[np.abs(self.multipliers - 1.0) > NEUTRAL]

    @property
    def neutral(self) -> int:
        """Multipliers within NEUTRAL of 1: the phase's, and one for every symmetry of the loop
        whose coordinate was not left out."""
        return len(self.multipliers) - len(self.transverse)


@dataclass(frozen=True)
class Floquet(Multipliers):
    """Multipliers of a planar body by two methods.

    Attributes:
        variational: (n,) by the linearised step map, in the same order.
        disagreement: largest difference between the two sets, matched, for all n.
    """

    variational: Complex
    disagreement: float


def differences(loop: LoopMap, cycle: Cycle, eps: float = DIFFERENCE) -> Array:
    """Monodromy matrix (n, n) by central differences, 2 n copies at once.

    Args:
        eps: perturbation of each coordinate, in units of cycle.scale.

    Raises:
        DivergenceError: a copy blew up.
        InvalidArgumentError: eps out of bounds.
    """
    require_number("eps", eps, 0.0, 0.1, open_low=True)
    nudges = np.diag(eps * cycle.scale)
    starts = np.concatenate([cycle.state + nudges, cycle.state - nudges])
    ends = flow_map(loop, starts, cycle.period)
    forward, backward = ends[: loop.size], ends[loop.size :]
    return ((forward - backward) / (2 * np.diag(nudges)[:, None])).T


def multipliers(monodromy: Array) -> tuple[Complex, Complex]:
    """Multipliers (n,), the one nearest to 1 ahead and then by size, and eigenvectors (n, n)."""
    values, vectors = np.linalg.eig(monodromy)
    values, vectors = values.astype(np.complex128), vectors.astype(np.complex128)
    phase = int(np.abs(values - 1.0).argmin())
    rank = np.abs(values)
    rank[phase] = np.inf
    order = np.argsort(-rank, kind="stable")
    return values[order], vectors[:, order]


def multipliers_of(loop: LoopMap, cycle: Cycle) -> Multipliers:
    """Multipliers of a cycle of any loop, by differences.

    Raises:
        DivergenceError: a copy blew up.
    """
    monodromy = differences(loop, cycle)
    values, vectors = multipliers(monodromy)
    moved = monodromy @ cycle.tangent
    change = np.linalg.norm((moved - cycle.tangent) / cycle.scale)
    return Multipliers(
        multipliers=values,
        phase_error=float(change / np.linalg.norm(cycle.tangent / cycle.scale)),
        monodromy=monodromy,
        leading_vector=vectors[:, 1],
    )


def floquet(loop: ClosedLoop, cycle: Cycle) -> Floquet:
    """Multipliers of a planar body's cycle by differences and by the linearised step map.

    Raises:
        DivergenceError: a copy blew up.
        InvalidArgumentError: no planar body in the twin; `multipliers_of` takes any loop.
    """
    found = multipliers_of(loop, cycle)
    _, exact = variational(loop, cycle.state, cycle.period)
    other = _matched(multipliers(exact)[0], found.multipliers)
    return Floquet(
        multipliers=found.multipliers,
        phase_error=found.phase_error,
        monodromy=found.monodromy,
        leading_vector=found.leading_vector,
        variational=other,
        disagreement=float(np.abs(found.multipliers - other).max()),
    )


def target_multipliers(target: Target) -> Complex:
    """Multipliers (n,) of the system a target is a cycle of, the phase's ahead.

    By DOP853 on x' = f(x), X' = f'(x) X over one period.

    Raises:
        InvalidArgumentError: a target without a system (Lissajous figures, arrays).
    """
    if target.rhs is None:
        raise InvalidArgumentError("target", "the cycle of a system x' = f(x)", target.name)
    n, rhs = target.n_outputs, target.rhs

    def extended(t: float, z: Array) -> Array:
        x, X = z[:n], z[n:].reshape(n, n)
        return np.concatenate([rhs(t, x), (jacobian(rhs, x) @ X).ravel()])

    start = np.concatenate([target.sample(np.zeros(1))[0], np.eye(n).ravel()])
    solution = solve_ivp(
        extended, (0.0, target.period), start, method="DOP853", rtol=RTOL, atol=ATOL
    )
    return multipliers(solution.y[n:, -1].reshape(n, n))[0]


def jacobian(rhs: Callable[[float, Array], Array], x: Array) -> Array:
    """f'(x) (n, n) by central differences of fourth order: exact for cubic polynomials."""

    def slope(width: float) -> Array:
        rows = [(rhs(0.0, x + e) - rhs(0.0, x - e)) / (2 * width) for e in width * np.eye(len(x))]
        return np.array(rows).T

    return (4 * slope(DIFFERENCE) - slope(2 * DIFFERENCE)) / 3


def _matched(values: Complex, to: Complex) -> Complex:
    """`values` in the order in which they lie nearest to `to`, each used once."""
    left, order = list(range(len(values))), []
    for wanted in to:
        best = min(left, key=lambda i: abs(values[i] - wanted))
        left.remove(best)
        order.append(best)
    return values[order]
