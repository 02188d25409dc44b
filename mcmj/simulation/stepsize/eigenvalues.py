"""The largest stable step of a linearised body, by eigenvalues; see `onestep` for the theory."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import ArpackError, eigsh

from mcmj.reference.twin.adaptive import TOO_FAST
from mcmj.simulation.stepsize.linearisation import Linearised
from mcmj.simulation.stepsize.schemes import parts_of, pencil, rk4_radius, scheme_of, step_map
from mcmj.utils.validation import Array

DENSE = 100  # coordinates up to which dense symmetric eigenvalues are faster than Lanczos
DENSE_MODES = 240  # coordinates up to which all modes are found, for RK4
RK4_REACH = 2.616  # |z| inside RK4's region wherever Re z <= 0
GROWTH_SLACK = 1e-9  # rounding in the spectral radius of a step map


def limit_of(system: Linearised, integrator: str) -> float:
    """Largest stable step [s] of an integrator or compiled twin; infinity if every step is."""
    scheme = scheme_of(integrator, known=system.known)
    if system.feedback.nnz:
        return _closed_limit(system, scheme)
    return _open_limit(system, scheme)


def _open_limit(system: Linearised, scheme: str) -> float:
    if _bears_all(system, scheme):
        return math.inf
    return _rk4_limit(system) if scheme == "RK4" else _pencil_limit(system, scheme)


def stable_at(system: Linearised, integrator: str, step: float) -> bool:
    """Whether a step [s] is stable in open loop: one eigenvalue, where the limit takes several."""
    scheme = scheme_of(integrator, known=system.known)
    if _bears_all(system, scheme):
        return True
    if scheme == "RK4":
        return step <= _rk4_bound(system) or step <= _rk4_limit(system)
    if scheme == "adaptive_leapfrog":
        step /= parts_of(system, step)
    return _top(system, *pencil(system, scheme), step)[0] < 4.0


def _bears_all(system: Linearised, scheme: str) -> bool:
    """Whether S and C are negative at a glance: 'discrete' without tension or secants.

    Or whether no step is taken in parts that are too long for the springs.
    """
    if scheme == "adaptive_leapfrog":
        return _top(system, *pencil(system, scheme), TOO_FAST / system.damper_rate)[0] < 4.0
    return (
        scheme == "discrete"
        and system.material is system.tangent_material
        and abs(system.geometric).max() <= 1e-9 * system.material.max()
    )


def _pencil_limit(system: Linearised, scheme: str) -> float:
    """Smallest h with lambda_max(M^-1 (h^2 S + h C)) = 4.

    Each vector u bounds h by u'(h^2 S + h C)u = 4 u'M u, and the top vector at h gives a better
    bound: converges from above, quadratically (policy iteration).
    """
    S, C = pencil(system, scheme)
    value, u = _top(system, S, csr_array(S.shape), 1.0)
    if value <= 0.0:
        return math.inf
    step = math.inf
    for _ in range(60):
        s, c = float(u @ (S @ u)), float(u @ (C @ u))
        better = 8.0 / (c + math.sqrt(c * c + 16.0 * s)) if s > 0 or c > 0 else math.inf
        if not better < step * (1.0 - 1e-12):
            break
        step = better
        u = _top(system, S, C, step, u)[1]
    return step


def _top(
    system: Linearised, S: csr_array, C: csr_array, step: float, start: Array | None = None
) -> tuple[float, Array]:
    """Largest eigenvalue of M^-1 (h^2 S + h C), and its vector u with u'M u = 1."""
    root = 1.0 / np.sqrt(system.masses)
    scale = diags_array(root)
    matrix = scale @ (step * step * S + step * C) @ scale
    n = len(root)
    if n > DENSE:
        guess = _noise(n) if start is None else start / root + 1e-3 * _noise(n)
        try:
            values, vectors = eigsh(matrix, k=1, which="LA", v0=guess, tol=1e-8)
            return float(values[0]), root * vectors[:, 0]
        except ArpackError:  # clustered eigenvalues: slow, but sure
            pass
    values, vectors = eigh(matrix.toarray(), subset_by_index=(n - 1, n - 1))
    return float(values[0]), root * vectors[:, 0]


def _noise(n: int) -> Array:
    return np.random.default_rng(0).standard_normal(n) / math.sqrt(n)


def _rk4_limit(system: Linearised) -> float:
    """Smallest |z| / |lambda| over the modes, z on the edge of RK4's region; large: its bound."""
    if len(system.masses) > DENSE_MODES:
        return _rk4_bound(system)
    values = _modes(system)
    values = values[np.abs(values) > 0]
    return float((rk4_radius(values) / np.abs(values)).min())


def _rk4_bound(system: Linearised) -> float:
    """At most the limit, above 0.88 of it if stiffness or damping alone sets it, else above 0.5.

    lambda^2 + d lambda + k = 0 with Rayleigh quotients k and d of the mode: |lambda| is at most
    the larger of sqrt(k) and d.
    """
    zero = csr_array(system.damping.shape)
    k = _top(system, system.material + system.geometric, zero, 1.0)[0]
    d = _top(system, zero, system.damping, 1.0)[0]
    return RK4_REACH / max(math.sqrt(max(k, 0.0)), d)


def _modes(system: Linearised) -> npt.NDArray[np.complex128]:
    """Eigenvalues lambda (2 n,) [1/s] of the body's motion."""
    n = len(system.masses)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -system.stiffness.toarray() / system.masses[:, None]
    A[n:, n:] = -system.damping.toarray() / system.masses[:, None]
    return np.linalg.eigvals(A).astype(np.complex128)


def _closed_limit(system: Linearised, scheme: str) -> float:
    """First step on a fine grid, then by bisection, whose map grows more than it may.

    A body unstable by itself hides a slow growth of the scheme: then no more than in open loop.
    """
    modes = _modes(system)
    growth = max(0.0, float(modes.real.max()))
    longest = _open_limit(replace(system, feedback=0 * system.feedback), scheme)

    def stable(step: float) -> bool:
        if growth > 0.0 and step > min(1.0 / growth, longest):
            return False
        radius = np.abs(np.linalg.eigvals(step_map(system, scheme, step))).max()
        return bool(radius <= math.exp(2.0 * growth * step) * (1.0 + GROWTH_SLACK))

    grid = np.geomspace(1e-3, 1e3, 121) / np.abs(modes).max()
    bad = next((i for i, step in enumerate(grid) if not stable(step)), None)
    if bad is None:
        return math.inf
    low, high = (grid[bad - 1] if bad else 0.0), grid[bad]
    while high - low > 1e-6 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return float(low)
