"""Spring laws beyond MuJoCo's own polynomial: any pull = law(x1, x2, k1, k3, d1, d3)."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from math import tanh

import numba
from numba import types

from mcmj.core.callbacks.law_table import register
from mcmj.core.callbacks.pointers import TAG
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

Pull = Callable[[float, float, float, float, float, float], float]

_SIGNATURE = types.float64(*[types.float64] * 6)
NATIVE = "native"  # MuJoCo's polynomial springs: no callback


@dataclass(frozen=True)
class SpringLaw:
    """A spring's pull [N] from its elongation x1 [m], its rate x2 [m/s] and its parameters.

    Attributes:
        name: the law's name, written to body files; only [A-Za-z0-9_].
        pull: function (x1, x2, k1, k3, d1, d3) -> pull that Numba can compile; positive
            pulls the ends together. The four parameters are the body's, used as it likes.
    """

    name: str
    pull: Pull

    def __post_init__(self) -> None:
        if not self.name.replace("_", "").isalnum() or self.name == NATIVE:
            raise InvalidArgumentError("name", f"letters and digits, not {NATIVE!r}", self.name)
        if not callable(self.pull):
            raise InvalidArgumentError("pull", "a function of six numbers", self.pull)

    @property
    def tag(self) -> float:
        """What marks this kind of law in tendon user data."""
        return TAG

    @functools.cached_property
    def _compiled(self):
        return numba.cfunc(_SIGNATURE, cache=self.pull in _SUPPLIED)(self.pull)

    def key(self, n_springs: int) -> float:
        """What tendon user data of a body of n_springs springs holds for this law."""
        return register(self._compiled)


def cubic(x1: float, x2: float, k1: float, k3: float, d1: float, d3: float) -> float:
    """p + q with p = k3 x1^3 + k1 x1, q = d3 x2^3 + d1 x2 (Hauser et al. 2012, Eq. 3)."""
    return x1 * (k1 + k3 * x1 * x1) + x2 * (d1 + d3 * x2 * x2)


def tansig(x1: float, x2: float, k1: float, k3: float, d1: float, d3: float) -> float:
    """Saturating law of the authors' toolbox: p = k1 tanh(k3 x1), q = d1 tanh(d3 x2).

    k1 and d1 are the largest forces [N], k3 [1/m] and d3 [s/m] say how soon they are reached.
    The toolbox writes -1 + 2 k1 / (1 + exp(-2 k3 x1)), which adds a constant k1 - 1 to the pull
    and so moves the rest length; that offset is left out here (equal for k1 = d1 = 1).
    """
    return k1 * tanh(k3 * x1) + d1 * tanh(d3 * x2)


_SUPPLIED = (cubic, tansig)
SPRING_LAWS = {function.__name__: SpringLaw(function.__name__, function) for function in _SUPPLIED}


def spring_law(springs: str | SpringLaw) -> SpringLaw | None:
    """The law for `springs`: None for "native", a supplied law by name, or the law given.

    Raises:
        UnknownNameError: a name that is not a supplied law's.
    """
    if isinstance(springs, SpringLaw):
        return springs
    if springs == NATIVE:
        return None
    if springs not in SPRING_LAWS:
        raise UnknownNameError("spring law", springs, [NATIVE, *SPRING_LAWS])
    return SPRING_LAWS[springs]
