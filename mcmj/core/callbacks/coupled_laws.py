"""Laws that see the whole body: every spring's pull from all elongations and rates.

The static nonlinear feedback K(x, u) of the theory (Hauser et al. 2012, section 3), run by
MuJoCo's passive force callback, and so in every stage of its integrators.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numba
from numba import carray, types

from mcmj.core.callbacks.law_table import register
from mcmj.core.callbacks.pointers import COUPLED_TAG, doubles
from mcmj.core.callbacks.spring_laws import SpringLaw

CoupledPull = Callable[[Any, Any, Any, Any], None]

_FIRST_PARAMETER = 3  # rows: two that it does not see, l0, k1, k3, d1, d3
_SIGNATURE = types.void(*[types.int64] * 6)


@dataclass(frozen=True)
class CoupledLaw(SpringLaw):
    """The pulls [N] of all L springs from all elongations [m] and rates [m/s].

    Attributes:
        name: the law's name, written to body files; only [A-Za-z0-9_].
        pull: function (x1, x2, parameters, out) that Numba can compile: x1, x2 (L,),
            parameters (L, 4) the springs' k1, k3, d1, d3; writes the pulls to out (L,).
    """

    pull: CoupledPull  # type: ignore[assignment]  # of all springs, not of one

    @property
    def tag(self) -> float:
        """What marks this kind of law in tendon user data."""
        return COUPLED_TAG

    def key(self, n_springs: int) -> float:
        """The same for a law that sees all springs: no other number of them calls it."""
        return register(self._compiled, n_springs)

    @functools.cached_property
    def _compiled(self):
        pull = numba.njit(self.pull)

        def law(x1, x2, user, count, width, out):
            table = carray(doubles(user), (count, width))
            parameters = table[:, _FIRST_PARAMETER : _FIRST_PARAMETER + 4]
            pull(
                carray(doubles(x1), count), carray(doubles(x2), count),
                parameters, carray(doubles(out), count),
            )  # fmt: skip

        return numba.cfunc(_SIGNATURE)(law)
