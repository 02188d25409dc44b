"""One step of each integrator on the linearised body, and where it is stable.

For M v' = -(K + G) q - D v + f, with f = -F q held over the step (see `linearisation`; the
leapfrog takes the mean of f and the one before):

    Euler         M (v+ - v) = h (f - (K + G) q - D v)                         q+ = q + h v+
    implicit      (M + h B) (v+ - v) = the same,  B = D within each node       q+ = q + h v+
    implicitfast  the same with B = the diagonal of D
    discrete      (M + h D + h^2 K) (v+ - v) = the same - h^2 K v              q+ = q + h v+
    leapfrog      M (w+ - w) = h (f - (K + G) q - D (3 w - w-) / 2)            q+ = q + h w+
    adaptive_leapfrog: the same, or in n = ceil(2 h r) > 1 parts, r = damper_rate
    RK4           x+ = (1 + z + z^2/2 + z^3/6 + z^4/24) x, z = h A, A the system's matrix

Found by measurement on MuJoCo 3.17 (tests/test_steplimit.py repeats it): its implicit
integrators drop what a spring's damper couples between two nodes, for lack of room in their
sparse matrix, and implicitfast even between the coordinates of one node. What callback springs push
with, no integrator knows: B = D = K = 0 on the left, and all of those are Euler.

With K, G, D symmetric and K, D not negative, all but RK4 lose stability by an oscillation
q_k = (-1)^k u, whose equation is a symmetric pencil (Rayleigh quotients give the Jury
conditions of a quadratic or cubic; -1 is the first root out):

    stable  <=>  lambda_max(M^-1 (h^2 S + h C)) < 4        S, C: `pencil`

with h / n for h where a step is taken in parts.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array, kron

from mcmj.core.integrators import INTEGRATORS, TWINNED, TWINS
from mcmj.reference.twin.adaptive import TOO_FAST
from mcmj.simulation.stepsize.linearisation import Linearised
from mcmj.utils.validation import Array

BY_NAME = {**TWINS, **TWINNED, **INTEGRATORS}  # a compiled twin takes the same step as MuJoCo


def scheme_of(integrator: str, *, known: bool) -> str:
    """The scheme that an integrator is; without derivatives of the springs, often Euler."""
    row = BY_NAME[integrator]
    return "Euler" if row.implicit and not known else row.name


def pencil(system: Linearised, scheme: str) -> tuple[csr_array, csr_array]:
    """S [N/m] and C [N s/m] (n, n) of the stability condition, open loop; not for RK4."""
    stiffness, damping = system.material + system.geometric, system.damping
    if scheme == "discrete":
        stiffness = stiffness - 2 * system.tangent_material
    factor = BY_NAME[scheme].damping_factor
    return stiffness, factor * damping - 4 * known_damping(system, scheme)


def known_damping(system: Linearised, scheme: str) -> csr_array:
    """B: the part of D (n, n) that an implicit integrator solves for."""
    damping, d = system.tangent_damping, system.dimensions
    n = damping.shape[0]
    if scheme == "discrete":
        return damping
    if scheme == "implicitfast":
        return csr_array(diags_array(damping.diagonal()))
    if scheme == "implicit":
        same_node = kron(diags_array(np.ones(n // d)), np.ones((d, d)))
        return csr_array(damping.multiply(same_node))
    return csr_array((n, n))


def step_map(system: Linearised, scheme: str, step: float) -> Array:
    """Matrix that advances (q, v) (2 n,), or (q, w, w-) (3 n,), by a step [s] in closed loop."""
    if scheme == "adaptive_leapfrog":
        if (parts := parts_of(system, step)) > 1:
            free, held = _in_parts(system, step, parts)
            free[:, : len(system.masses)] -= held @ system.feedback.toarray()
            return free
        scheme = "leapfrog"
    advance, held = _free_and_held(system, scheme, step)
    n = len(system.masses)
    fed_back = held @ system.feedback.toarray()
    advance[:, :n] -= fed_back
    if scheme == "leapfrog":  # of q_k and q_{k-1} = q_k - h w_k the mean
        advance[:, n : 2 * n] += 0.5 * step * fed_back
    return advance


def _free_and_held(system: Linearised, scheme: str, h: float) -> tuple[Array, Array]:
    """x+ = free x + held f for a force f (n,) held over the physics step h."""
    n = len(system.masses)
    stiffness = (system.material + system.geometric).toarray()
    damping, mass, zero, one = system.damping.toarray(), system.masses, np.zeros((n, n)), np.eye(n)
    if scheme == "RK4":
        inverse = one / mass[:, None]
        A = np.block([[zero, one], [-inverse @ stiffness, -inverse @ damping]])
        return _rk4(h * A, h * np.vstack([zero, inverse]))
    metric = np.diag(mass) + h * known_damping(system, scheme).toarray()
    on_v = damping
    if scheme == "discrete":
        material = system.tangent_material.toarray()
        metric, on_v = metric + h * h * material, damping + h * material
    kick = h * np.linalg.inv(metric)
    if scheme == "leapfrog":
        change = np.hstack([-kick @ stiffness, one - 1.5 * kick @ damping, 0.5 * kick @ damping])
        before = np.hstack([zero, one, zero])
    else:
        change = np.hstack([-kick @ stiffness, one - kick @ on_v])
        before = np.zeros((0, 2 * n))
    at = np.eye(n, change.shape[1])
    held = np.vstack([h * kick, kick, np.zeros((len(before), n))])
    return np.vstack([at + h * change, change, before]), held


def parts_of(system: Linearised, step: float) -> int:
    """Number of parts in which the adaptive leapfrog takes a step [s] of small motions."""
    return max(1, math.ceil(step * system.damper_rate / TOO_FAST))


def _in_parts(system: Linearised, step: float, parts: int) -> tuple[Array, Array]:
    """x+ = free x + held f for x = (q, w, w-), as `reference.twin.adaptive` says.

    Within the step the state is (q, V, w, f).
    """
    n, h = len(system.masses), step / parts
    zero, one, inverse = np.zeros((n, n)), np.eye(n), np.diag(1.0 / system.masses)
    stiffness = (system.material + system.geometric).toarray()
    rate = np.hstack([-inverse @ stiffness, -inverse @ system.damping.toarray(), zero, inverse])
    q, _, w, f = np.vsplit(np.eye(4 * n), 4)

    def part(before: float) -> Array:
        kicked = w + 0.5 * (before + h) * rate
        return np.vstack([q + h * kicked, kicked + 0.5 * h * rate, kicked, f])

    seen = np.hstack([zero, 1.5 * one, -0.5 * one, zero])  # V of (q, w, w-, f)
    done = np.linalg.matrix_power(part(h), parts - 1) @ part(0.0) @ np.vstack([q, seen, seen, f])
    v, kick = (w + 0.5 * h * rate) @ done, 0.5 * step * rate @ done
    after = np.vstack([q @ done, v - kick, v - 3.0 * kick])
    return after[:, : 3 * n], after[:, 3 * n :]


def _rk4(z: Array, push: Array) -> tuple[Array, Array]:
    """R(z) and phi(z) push, with R = 1 + z phi."""
    one = np.eye(len(z))
    phi = one + z @ (one / 2 + z @ (one / 6 + z / 24))
    return one + z @ phi, phi @ push


def rk4_radius(values: npt.NDArray[np.complex128]) -> Array:
    """Largest h |lambda| that RK4 bears in the directions of eigenvalues lambda; |R(z)| = 1 there.

    2 sqrt(2) = 2.828 on the imaginary axis, 2.785 on the real one, from 2.616 to 2.961 between.
    """
    turn = np.exp(1j * np.clip(np.abs(np.angle(values)), np.pi / 2, np.pi))
    low, high = np.full(values.shape, 2.5), np.full(values.shape, 3.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        z = middle * turn
        inside = np.abs(1 + z * (1 + z * (0.5 + z * (1 / 6 + z / 24)))) <= 1
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low
