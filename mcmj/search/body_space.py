"""Bodies around a drawn one, by vectors: what a design may change, and in which units.

    springs         k1, k3, d1, d3 times exp(x): four numbers a spring
    rest_lengths    + STRESS x [m], so that the body starts under stress
    positions       + SHIFT x [m], two numbers a node; the rest lengths follow
    masses          times exp(x), a number a free node
    feedback        w_fb + PUSH x [N], a number a free node and output

The springs join the same nodes as in the drawn body, and the same nodes are fixed. x = 0 is the
drawn body.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mcmj.core.body import Body, spring_lengths
from mcmj.utils.validation import Array, as_array, require_names

STRESS, SHIFT, PUSH = 0.05, 10.0, 5.0
PARAMETERS = ("k1", "k3", "d1", "d3")


def _springs(body: Body, x: Array) -> Body:
    factors = np.exp(x.reshape(len(PARAMETERS), -1))
    changed = {n: getattr(body, n) * f for n, f in zip(PARAMETERS, factors, strict=True)}
    return replace(body, **changed)


def _rest_lengths(body: Body, x: Array) -> Body:
    return replace(body, rest_lengths=body.rest_lengths + STRESS * x)


def _positions(body: Body, x: Array) -> Body:
    before = spring_lengths(body.positions, body.springs)
    moved = body.positions + SHIFT * x.reshape(body.positions.shape)
    after = spring_lengths(moved, body.springs)
    return replace(body, positions=moved, rest_lengths=body.rest_lengths + (after - before))


def _masses(body: Body, x: Array) -> Body:
    masses = body.masses.copy()
    masses[body.free] *= np.exp(x)
    return replace(body, masses=masses)


def _feedback(body: Body, x: Array) -> Body:
    weights = body.w_fb.copy()
    weights[body.free] += PUSH * x.reshape(len(body.free), -1)
    return replace(body, w_fb=weights)


_Part = tuple[Callable[[Body], int], Callable[[Body, Array], Body]]
VARIED: dict[str, _Part] = {
    "springs": (lambda body: len(PARAMETERS) * body.n_springs, _springs),
    "rest_lengths": (lambda body: body.n_springs, _rest_lengths),
    "positions": (lambda body: body.positions.size, _positions),
    "masses": (lambda body: len(body.free), _masses),
    "feedback": (lambda body: len(body.free) * body.n_outputs, _feedback),
}


@dataclass(frozen=True)
class BodySpace:
    """Bodies around `drawn`, by a vector.

    Attributes:
        drawn: the body at 0.
        varied: what differs, names of VARIED.

    Raises:
        InvalidArgumentError, UnknownNameError: not names of these, each once.
    """

    drawn: Body
    varied: Sequence[str]

    def __post_init__(self) -> None:
        require_names("varied", self.varied, VARIED)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return sum(VARIED[name][0](self.drawn) for name in self.varied)

    def body(self, x: Array) -> Body:
        """The body at x (size,).

        Raises:
            InvalidArgumentError: another shape, or a body that cannot be, such as one with two
                nodes at the same place or without a rest length.
        """
        values = as_array("x", x, (self.size,))
        body, at = self.drawn, 0
        for name in self.varied:
            count, change = VARIED[name]
            body = change(body, values[at : at + count(self.drawn)])
            at += count(self.drawn)
        return body
