"""The largest stable step of each integrator, from the linearised body, and what to do about it.

A prediction, not a promise: it is exact for a linear body in small motion, and for a nonlinear
one as good as the `elongation` and `speed` it is given, since stiffness and damping grow as
k1 + 3 k3 x1^2 and d1 + 3 d3 x2^2. It knows nothing of accuracy, nor of nodes that pass each
other within a step. Theory: `linearisation` and `onestep`; measured: scripts/hard_cases.py.
"""

import math
import warnings
from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.core.integrators import DEFAULT_INTEGRATOR, INTEGRATORS, Integrator, integrator_named
from mcmj.core.options import Options
from mcmj.simulation.stepsize.eigenvalues import RK4_REACH, limit_of, stable_at
from mcmj.simulation.stepsize.linearisation import Linearised, Motion, linear_system, slopes
from mcmj.simulation.stepsize.schemes import BY_NAME
from mcmj.utils.errors import StabilityWarning
from mcmj.utils.validation import Array, require_number

__all__ = ["Advice", "recommend", "stability_limit", "warn_if_unstable"]

SAFETY = 0.9  # a recommended step over the limit
CHEAPEST_FIRST = sorted(
    (row for row in INTEGRATORS.values() if row.advised), key=lambda row: (row.stages, row.implicit)
)


@dataclass(frozen=True)
class Advice:
    """What to do about a step.

    Attributes:
        integrator: the one asked about.
        limit: its largest stable step [s]; infinity if every step is stable.
        substeps: physics steps in a control step with which it is stable.
        others: integrators that are stable at the step as it is, cheapest first.
    """

    integrator: str
    limit: float
    substeps: int
    others: tuple[str, ...]

    def __str__(self) -> str:
        """The advice in words."""
        ways = [f"substeps={self.substeps}"]
        ways += [f"integrator={name!r}" for name in self.others if name != self.integrator]
        return " or ".join(ways[:3])


def stability_limit(
    body: Body,
    integrator: str,
    *,
    speed: object = 0.0,
    elongation: object = 0.0,
    secant: bool = False,
    w_out: object = None,
    springs: str | SpringLaw = "native",
) -> float:
    """Largest stable step [s]; infinity if every step is stable.

    In closed loop the body itself may be unstable, which is how it makes a limit cycle: then
    the limit is where a step multiplies more than exp(2 s h), s the body's own growth rate, and
    at most 1 / s.

    Args:
        integrator: a name of mcmj.core.integrators, or a compiled twin's.
        speed, elongation: largest spring rate [m/s] and elongation [m] expected; numbers or (L,).
        secant: where motions of that size grow, and not small errors on top of them: a longer
            step, at which a run may survive as noise.
        w_out, springs: as for `linear_system`.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    integrator_named(integrator, BY_NAME)
    motion = Motion(elongation, speed, secant)
    system = linear_system(body, motion=motion, w_out=w_out, springs=springs)
    return limit_of(system, integrator)


def recommend(
    body: Body,
    timestep: float,
    integrator: str = DEFAULT_INTEGRATOR,
) -> Advice:
    """Substeps, or other integrators, with which a step [s] is stable in open loop near rest.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    require_number("timestep", timestep, 0.0, open_low=True)
    integrator_named(integrator, BY_NAME)
    return _advice(linear_system(body), timestep, integrator)


def _advice(system: Linearised, timestep: float, integrator: str) -> Advice:
    limit = limit_of(system, integrator)
    enough = math.ceil(timestep / (SAFETY * limit) - 1e-9) if limit > 0 else 1
    others = [
        row.name
        for row in CHEAPEST_FIRST
        if row.name != integrator and stable_at(system, row.name, timestep / SAFETY)
    ]
    return Advice(integrator, limit, max(1, enough), tuple(others))


def warn_if_unstable(body: Body, options: Options) -> None:
    """Warn of a step that makes the body blow up however small its motions; else cost little."""
    step, integrator, springs = options.physics_step, options.integrator, options.springs
    if isinstance(springs, CoupledLaw):
        return  # no slopes to go by
    if _surely_stable(body, step, BY_NAME[integrator], springs):
        return
    system = linear_system(body, springs=springs)
    if stable_at(system, integrator, step):
        return
    advice = _advice(system, options.timestep, integrator)
    warnings.warn(
        f"step {1e3 * step:.4g} ms is above {1e3 * advice.limit:.4g} ms, the stability limit of "
        f"integrator {integrator} for this body at rest: it may blow up; use {advice}",
        StabilityWarning,
        stacklevel=3,
    )


# --- a bound in a few operations -------------------------------------------------------------


def _surely_stable(body: Body, step: float, scheme: Integrator, springs: str | SpringLaw) -> bool:
    """Sufficient: eigenvalues of M^-1 (K + G) and M^-1 D are at most twice the sum at a node.

    (A spring's matrix between two nodes is at most twice its part within the nodes.)
    """
    gap = body.positions[body.springs[:, 1]] - body.positions[body.springs[:, 0]]
    lengths = np.hypot.reduce(gap, axis=1)
    x1 = lengths - body.rest_lengths
    k, d, tension = slopes(body, x1, np.zeros_like(x1), springs)
    k_top = _largest_at_node(body, np.maximum(k, tension / lengths))
    d_top = _largest_at_node(body, d)
    if scheme.stages > 1:
        return step * max(math.sqrt(k_top), d_top) < RK4_REACH
    return step * step * k_top + scheme.damping_factor * step * d_top < 4.0


def _largest_at_node(body: Body, values: Array) -> float:
    sums = np.bincount(body.springs.ravel(), np.repeat(np.abs(values), 2), body.n_nodes)
    return 2.0 * float((sums / body.masses)[body.free].max())
