"""Feedback linearisation, run: a spring that static feedback makes another system.

One mass (1 kg) on one nonlinear spring along x, x1 = l - l0, x2 = dl/dt (Hauser et al. 2012,
Eqs. 1 to 5):

    x1' = x2,   x2' = -p(x1) - q(x2) + K,        p = k1 x1 + k3 x1^3,  q = d1 x2 + d3 x2^3
    K = p(x1) + q(x2) + G(x1, x2) + u        ->  x2' = G(x1, x2) + u
    K# = p(x1) + q(x2) + u                   ->  the double integrator, x2' = u

n such masses, each with its own K_i and G_i(x, x') of all of them, make a system of order 2 n.
They also make any x' = F(x) of order n: `lift`.
"""

from collections.abc import Callable, Sequence

import numba
import numpy as np

from mcmj.analysis.spring_arrays import parallel_body
from mcmj.core.body import Body
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array, require_count, require_number

with extra("theory", "emulation needs SymPy"):
    import sympy as sp

Acceleration = Callable[[float, float], float]
Accelerations = Callable[[Array, Array, Array], None]


SPRING = 3.0, 150.0, 1.0, 150.0  # k1, k3, d1, d3 (SI)
NAMES = "x1", "x2"  # of a scalar function's arguments


def emulation_body(masses: int = 1) -> Body:
    """So many masses of 1 kg, each on its own nonlinear spring, side by side on one wall.

    Raises:
        InvalidArgumentError: not at least one mass.
    """
    require_count("masses", masses, 1)
    return parallel_body(*(np.full(masses, value) for value in SPRING))


def static_feedback(name: str, g: Acceleration, *, mismatch: float = 0.0) -> SpringLaw:
    """The law p + q - K of one spring under K = p + q + G; u is an input channel.

    Args:
        name: the law's name.
        g: G(x1, x2) [m/s^2], a plain function that Numba can compile.
        mismatch: what K does not know of p and q: K = (1 - mismatch) (p + q) + G. A negative
            one leaves a spring and a damper of the wrong sign.
    """
    compiled: Acceleration = numba.njit(g)
    known = 1.0 - mismatch

    def pull(x1: float, x2: float, k1: float, k3: float, d1: float, d3: float) -> float:
        passive = x1 * (k1 + k3 * x1 * x1) + x2 * (d1 + d3 * x2 * x2)
        feedback = known * passive + compiled(x1, x2)
        return passive - feedback

    return SpringLaw(name, pull)


def coupled_feedback(name: str, g: Accelerations) -> CoupledLaw:
    """The same for several masses, K_i = p_i + q_i + G_i.

    Args:
        name: the law's name.
        g: function (x, v, out) that Numba can compile: elongations and rates (n,), writes
            the accelerations G_i [m/s^2] to out (n,).
    """
    compiled: Accelerations = numba.njit(g)

    def pull(x1: Array, x2: Array, parameters: Array, out: Array) -> None:
        compiled(x1, x2, out)
        for i in range(len(x1)):
            k1, k3, d1, d3 = parameters[i]
            passive = x1[i] * (k1 + k3 * x1[i] ** 2) + x2[i] * (d1 + d3 * x2[i] ** 2)
            out[i] = passive - (passive + out[i])

    return CoupledLaw(name, pull)


def lift(
    states: Sequence[sp.Symbol], rates: Sequence[sp.Expr], *, contraction: float = 10.0
) -> Accelerations:
    """G of the n masses that make x' = F(x), of any order n, one mass a state.

        x_i'' = G_i = (dF/dx x')_i - c (x_i' - F_i(x))

    Started with x' = F(x), the masses stay there, for (x' - F)' = -c (x' - F): what rounding
    and the integrator add dies out at the rate c.

    Args:
        states: the n symbols x.
        rates: F, n expressions in them.
        contraction: c >= 0 [1/s].

    Raises:
        InvalidArgumentError: other symbols in F, or not n expressions.
    """
    require_number("contraction", contraction, 0.0)
    field = sp.Matrix([sp.sympify(rate) for rate in rates])
    strange = field.free_symbols - set(states)
    if len(field) != len(states) or strange:
        got = f"{len(field)} with {sorted(map(str, strange))} besides"
        raise InvalidArgumentError("rates", f"{len(states)} expressions in {list(states)}", got)
    speeds = sp.Matrix(sp.symbols(f"speed:{len(states)}"))
    accelerations = field.jacobian(list(states)) * speeds - contraction * (speeds - field)
    function = _vector_function(states, speeds, accelerations)

    def g(x: Array, v: Array, out: Array) -> None:
        values = function(x, v)
        for i in range(len(out)):
            out[i] = values[i]

    return g


def scalar_function(expression: str) -> Acceleration:
    """G(x1, x2) from its text, such as "-x1 + (1 - x1**2) * x2".

    Raises:
        InvalidArgumentError: not an expression in these names.
    """
    symbols = sp.symbols(NAMES)
    try:
        parsed = sp.sympify(expression, locals={s.name: s for s in symbols})
        strange = parsed.free_symbols - set(symbols)
    except (sp.SympifyError, SyntaxError, TypeError, AttributeError) as error:
        raise InvalidArgumentError("g", f"an expression in {', '.join(NAMES)}", expression) from (
            error
        )
    if strange:
        raise InvalidArgumentError(
            "g", f"an expression in {', '.join(NAMES)}", f"{expression!r}, with {strange}"
        )
    found: Acceleration = sp.lambdify(symbols, sp.Float(1.0) * parsed, modules="math")
    return found


def _vector_function(
    states: Sequence[sp.Symbol], speeds: sp.Matrix, expressions: sp.Matrix
) -> Callable[[Array, Array], tuple[float, ...]]:
    """Compiled function (x, v) -> tuple of numbers."""
    x, v = sp.DeferredVector("x"), sp.DeferredVector("v")
    names = {s: x[i] for i, s in enumerate(states)} | {s: v[i] for i, s in enumerate(speeds)}
    found: Callable[[Array, Array], tuple[float, ...]] = numba.njit(
        sp.lambdify([x, v], tuple(sp.Float(1.0) * e.subs(names) for e in expressions), "math")
    )
    return found
