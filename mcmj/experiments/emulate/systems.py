"""The systems that springs are made to be in scripts/emulate.py, and how each is compared.

Every system has a spring law for MuJoCo, and an independent right-hand side for DOP853: the
target's own equations, which know nothing of springs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import cos, sin

import numpy as np

from mcmj.analysis.emulation import (
    Acceleration,
    coupled_feedback,
    lift,
    scalar_function,
    static_feedback,
)
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array

with extra("theory", "emulation needs SymPy"):
    import sympy as sp

DRIVE_AMPLITUDE, DRIVE_RATE = 0.37, 1.2  # N, rad/s
PACE = 0.1  # of Lorenz's time: a run of 8 s is then still predictable


@dataclass(frozen=True)
class System:
    """A target and the masses that emulate it.

    Attributes:
        law: the spring law p + q - K.
        positions, velocities: (n,) where the masses start [m], [m/s].
        rhs: of the target, (t, z) -> z'.
        states: the target's z are (x, x') of the masses, or their x alone.
        drive: u(t) of times (T,) [s], or None.
    """

    law: SpringLaw
    positions: Array
    velocities: Array
    rhs: Callable[[float, Array], list[float]]
    states: str = "x, x'"
    drive: Callable[[Array], Array] | None = None

    @property
    def start(self) -> Array:
        """z(0)."""
        if self.states == "x":
            return self.positions
        return np.concatenate([self.positions, self.velocities])


def _no_force(x1: float, x2: float) -> float:
    return 0.0 * x1


def _van_der_pol(x1: float, x2: float) -> float:
    return -x1 + (1.0 - x1 * x1) * x2


def _duffing(x1: float, x2: float) -> float:
    return x1 - x1 * x1 * x1 - 0.3 * x2


def _pendulum(x1: float, x2: float) -> float:
    return -9.81 * sin(x1) - 0.1 * x2


def _drive(times: Array) -> Array:
    return DRIVE_AMPLITUDE * np.cos(DRIVE_RATE * times)


def single(
    name: str, g: Acceleration, start: tuple[float, float], *, driven: bool = False
) -> System:
    """x'' = G(x, x') + u by one mass."""

    def rhs(t: float, z: Array) -> list[float]:
        push = DRIVE_AMPLITUDE * cos(DRIVE_RATE * t) if driven else 0.0
        return [z[1], g(z[0], z[1]) + push]

    drive = _drive if driven else None
    x, v = np.array(start[:1]), np.array(start[1:])
    return System(static_feedback(name, g), x, v, rhs, drive=drive)


def _generator() -> System:
    """The driven Duffing with u made by a second mass: no input, order 4."""

    def g(x: Array, v: Array, out: Array) -> None:
        out[0] = x[0] - x[0] ** 3 - 0.3 * v[0] + x[1]
        out[1] = -(DRIVE_RATE**2) * x[1]

    def rhs(t: float, z: Array) -> list[float]:
        push = DRIVE_AMPLITUDE * cos(DRIVE_RATE * t)
        return [*z[2:], _duffing(z[0], z[2]) + push, -(DRIVE_RATE**2) * push]

    x, v = np.array([1.0, DRIVE_AMPLITUDE]), np.zeros(2)
    return System(coupled_feedback("generator_duffing", g), x, v, rhs)


def _lorenz() -> System:
    """Order 3 by three masses, at PACE times its usual pace."""
    x, y, z = states = sp.symbols("x y z")
    field = [10 * (y - x), x * (28 - z) - y, x * y - sp.Rational(8, 3) * z]
    rates = [PACE * rate for rate in field]
    law = coupled_feedback("lorenz", lift(states, rates))

    def rhs(t: float, p: Array) -> list[float]:
        a, b, c = p
        return [PACE * 10 * (b - a), PACE * (a * (28 - c) - b), PACE * (a * b - 8 / 3 * c)]

    start = np.array([1.0, 1.0, 20.0])
    return System(law, start, np.array(rhs(0.0, start)), rhs, states="x")


SYSTEMS: dict[str, Callable[[], System]] = {
    "double_integrator": lambda: single("double_integrator", _no_force, (0.0, 0.0), driven=True),
    "van_der_pol": lambda: single("van_der_pol", _van_der_pol, (1.0, 0.0)),
    "duffing": lambda: single("duffing", _duffing, (0.0, 1.5)),
    "pendulum": lambda: single("pendulum", _pendulum, (2.5, 0.0)),
    "driven_duffing": lambda: single("driven_duffing", _duffing, (1.0, 0.0), driven=True),
    "generator_duffing": _generator,
    "lorenz": _lorenz,
}


@cache
def system(name: str) -> System:
    """A system by its name; compiled once a process.

    Raises:
        UnknownNameError: no such system.
    """
    if name not in SYSTEMS:
        raise UnknownNameError("target", name, SYSTEMS)
    return SYSTEMS[name]()


def mismatched(mismatch: float) -> System:
    """Van der Pol where a share of p and q is unknown to K."""
    law = static_feedback("mismatched", _van_der_pol, mismatch=mismatch)
    whole = system("van_der_pol")
    return System(law, whole.positions, whole.velocities, whole.rhs)


def user_system(expression: str) -> System:
    """x'' = G(x, x') + u for the text of a G(x1, x2), from (1, 0)."""
    return single("user", scalar_function(expression), (1.0, 0.0))
