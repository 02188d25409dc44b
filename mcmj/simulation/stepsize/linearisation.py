"""The linearised body: mass, stiffness and damping matrices in the coordinates of free nodes.

Small motions (q, v) about a configuration with spring axes n and transverse directions t:

    M v' = -(K + G + F) q - D v
    K = sum_j p'(x1_j) J_j^T J_j        material stiffness,  p' = k1 + 3 k3 x1^2
    G = sum_j (p(x1_j) / l_j) T_j^T T_j    geometric stiffness: a tensioned spring turns
    D = sum_j q'(x2_j) J_j^T J_j        damping,             q' = d1 + 3 d3 x2^2
    F = -w_fb diag(g) W_out^T J         what the closed loop adds; not symmetric

J_j = dl_j/dq and T_j = l_j dphi_j/dq are the spring's axis and the normals to it (one in the
plane, two in space), with opposite signs at its two ends. Coordinates are (x, y) or (x, y, z) of
each free node in node order, as MuJoCo's. Left out: the terms of first order in the velocities
of turning springs.

For motions that are not small the secants p(x1) / x1 = k1 + k3 x1^2, q(x2) / x2 = d1 + d3 x2^2
take the place of p' and q': with a damper alone, v+ = v - h q(v) / m grows if h q(v) / v > 2 m,
whereas tangents say whether a small error on top of the motion grows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array

from mcmj.core.body import Body, damper_reach
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.callbacks.spring_laws import SpringLaw, cubic, spring_law
from mcmj.core.readout import Readout
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_above

_NUDGE = 1e-6  # of a callback law's argument, for its slope by central differences


@dataclass(frozen=True)
class Linearised:
    """M v' = -(K + G + F) q - D v; n = dimensions x free nodes.

    Attributes:
        masses: (n,) [kg].
        material, geometric, feedback: (n, n) sparse K, G, F [N/m].
        damping: (n, n) sparse D [N s/m].
        tangent_material, tangent_damping: K and D with tangents, which are what an implicit
            integrator solves for.
        known: whether it knows them: native springs, not a callback's.
        dimensions: coordinates of a node, 2 or 3.
        damper_rate: bound on the eigenvalues of M^-1 D with tangents [1/s], see `damper_reach`.
    """

    masses: Array
    material: csr_array
    geometric: csr_array
    damping: csr_array
    feedback: csr_array
    tangent_material: csr_array
    tangent_damping: csr_array
    known: bool = True
    dimensions: int = 2
    damper_rate: float = 0.0

    @property
    def stiffness(self) -> csr_array:
        """K + G + F [N/m]."""
        return self.material + self.geometric + self.feedback


@dataclass(frozen=True)
class Motion:
    """How large the motions are; none: small ones.

    Attributes:
        elongation: largest |x1| expected on top of the configuration's [m], a number or (L,):
            stiffness and tension grow to it.
        speed: largest |x2| expected [m/s], a number or (L,).
        secant: secants instead of tangents.
    """

    elongation: object = 0.0
    speed: object = 0.0
    secant: bool = False


SMALL = Motion()


def linearise(
    body: Body, positions: object = None, *, w_out: object = None, gate: object = 1.0
) -> tuple[csr_array, csr_array]:
    """Stiffness K + G + F (n, n) [N/m] and damping D (n, n) [N s/m] of small motions.

    Args and errors: as for `linear_system`.
    """
    system = linear_system(body, positions, w_out=w_out, gate=gate)
    return system.stiffness, system.damping


def linear_system(
    body: Body,
    positions: object = None,
    *,
    motion: Motion = SMALL,
    w_out: object = None,
    gate: object = 1.0,
    springs: str | SpringLaw = "native",
) -> Linearised:
    """The matrices of the body about a configuration at rest.

    Args:
        body: the body.
        positions: (N, D) where to linearise [m]; default: the start.
        motion: the size of its motions.
        w_out: readout (L, n_outputs), or with a bias in the last row; None: open loop.
        gate: (n_outputs,) or a number: 1 closes the channels, 0 opens them.
        springs: "native", or a law as Simulation takes it.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    start = body.positions if positions is None else positions
    where = as_array("positions", start, body.positions.shape)
    tail, head = body.springs.T
    gap = where[head] - where[tail]
    lengths = np.maximum(np.linalg.norm(gap, axis=1), np.finfo(float).tiny)
    axis = gap / lengths[:, None]
    x1 = lengths - body.rest_lengths
    further = _amplitudes("elongation", motion.elongation, body)
    widest = _away(x1, further)
    fastest = _amplitudes("speed", motion.speed, body)
    p_tangent, q_tangent, tension = slopes(body, widest, fastest, springs)
    along = _spring_rows(body, axis)
    tangent_material, tangent_damping = _assembled(along, p_tangent), _assembled(along, q_tangent)
    material, damping = tangent_material, tangent_damping
    if motion.secant:
        p_secant, q_secant, _ = slopes(body, widest, fastest, springs, secant=True)
        material, damping = _assembled(along, p_secant), _assembled(along, q_secant)
    return Linearised(
        masses=np.repeat(body.masses[body.free], body.dimensions),
        material=material,
        geometric=sum(
            _assembled(_spring_rows(body, normal), tension / (lengths + further))
            for normal in _normals(axis)
        ),
        damping=damping,
        feedback=_feedback(body, along, w_out, gate),
        tangent_material=tangent_material,
        tangent_damping=tangent_damping,
        known=spring_law(springs) is None,
        dimensions=body.dimensions,
        damper_rate=float((damper_reach(body) * q_tangent).max()),
    )


def slopes(
    body: Body, x1: Array, x2: Array, springs: str | SpringLaw, *, secant: bool = False
) -> tuple[Array, Array, Array]:
    """p'(x1) [N/m], q'(x2) [N s/m] (or p / x1, q / x2) and the tension p(x1) [N], (L,) each."""
    law = spring_law(springs)
    if isinstance(law, CoupledLaw):
        raise InvalidArgumentError("springs", "a law of one spring at a time", law.name)
    k1, k3, d1, d3 = body.k1, body.k3, body.d1, body.d3
    if law is None or law.pull is cubic:
        factor = 1 if secant else 3
        return k1 + factor * k3 * x1**2, d1 + factor * d3 * x2**2, x1 * (k1 + k3 * x1**2)
    function, parameters = law.pull, np.column_stack([k1, k3, d1, d3]).tolist()

    def pull(x1: Array, x2: Array) -> Array:
        arguments = zip(x1.tolist(), x2.tolist(), parameters, strict=True)
        return np.array([function(a, b, *row) for a, b, row in arguments])

    none = np.zeros(body.n_springs)
    return (
        _difference(lambda x: pull(x, none), x1, secant),
        _difference(lambda x: pull(none, x), x2, secant),
        pull(x1, none),
    )


def _difference(function: Callable[[Array], Array], x: Array, secant: bool) -> Array:
    """Central difference: narrow about x, or from -x to x."""
    step = np.maximum(np.abs(x), _NUDGE) if secant else np.maximum(_NUDGE, _NUDGE * np.abs(x))
    middle = np.zeros_like(x) if secant else x
    found: Array = (function(middle + step) - function(middle - step)) / (2 * step)
    return found


def _amplitudes(name: str, value: object, body: Body) -> Array:
    given = np.asarray(value)
    values = np.broadcast_to(given, (body.n_springs,)) if given.ndim == 0 else given
    array = as_array(name, values, (body.n_springs,))
    require_above(name, array, 0.0, strict=False)
    return array


def _away(values: Array, by: Array) -> Array:
    """Values moved away from 0 by an amount: the largest magnitudes to expect."""
    return values + np.where(values < 0, -by, by)


def _normals(axis: Array) -> list[Array]:
    """Unit vectors (L, D) at right angles to unit vectors (L, D), and to each other."""
    if axis.shape[1] == 2:
        return [np.stack([-axis[:, 1], axis[:, 0]], axis=1)]
    aside = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    first = aside / np.linalg.norm(aside, axis=1)[:, None]
    return [first, np.cross(axis, first)]


def _spring_rows(body: Body, direction: Array) -> csr_array:
    """(L, n): each spring's unit direction (L, D) at its head, its opposite at its tail."""
    d = body.dimensions
    column = np.full(body.n_nodes, -1)
    column[body.free] = np.arange(len(body.free))
    ends = column[body.springs]
    spring = np.broadcast_to(np.arange(body.n_springs)[:, None, None], (*ends.shape, d))
    columns = d * ends[:, :, None] + np.arange(d)
    values = direction[:, None, :] * np.array([-1.0, 1.0])[None, :, None]
    free = np.broadcast_to((ends >= 0)[:, :, None], columns.shape)
    shape = (body.n_springs, d * len(body.free))
    return csr_array((values[free], (spring[free], columns[free])), shape=shape)


def _assembled(rows: csr_array, weights: Array) -> csr_array:
    return csr_array(rows.T @ diags_array(weights) @ rows)


def _feedback(body: Body, along: csr_array, w_out: object, gate: object) -> csr_array:
    """F = -(w_fb e) diag(g) W_out^T J [N/m]: forces along the body's direction e."""
    n = along.shape[1]
    if w_out is None or body.n_outputs == 0:
        return csr_array((n, n))
    weights = Readout.of(w_out, body.n_springs, body.n_outputs).weights
    shape = (body.n_outputs,)
    gates = as_array("gate", np.broadcast_to(np.asarray(gate), shape), shape)
    push = np.zeros((n, body.n_outputs))
    for i, share in enumerate(body.direction):
        if share:
            push[i :: body.dimensions] = share * (body.w_fb[body.free] * gates)
    return csr_array(-push @ (along.T @ weights).T)
