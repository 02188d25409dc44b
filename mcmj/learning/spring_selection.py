"""Which springs must be sensed: orders in which a readout can do without them.

All work on the triangular factor of the regression, not on its samples. For the rows A of
lengths and Y of targets, with a ridge as rows sqrt(ridge) I below A:

    backward    of the springs left, drop the one without which |A W - Y|^2 grows least, by
                |w_j|^2 / [(A^T A)^-1]_jj (w_j: its weights; the OLS form of "optimal brain
                surgeon", Hassibi and Stork 1993)
    forward     add the one with which it shrinks most (orthogonal least squares, Chen et al.
                1989)
    random      for comparison
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.linalg import qr, svd

from mcmj.learning.regression import Regression
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

Order = npt.NDArray[np.int64]


def importance(regression: Regression, ridge: float, method: str, seed: int = 0) -> Order:
    """Springs (L,), the most important first: sense the first k to sense k.

    Args:
        regression: with all springs.
        ridge: as for Regression.solve.
        method: one of METHODS.
        seed: of the random order.

    Raises:
        UnknownNameError: no such method.
    """
    if method not in METHODS:
        raise UnknownNameError("pruning method", method, METHODS)
    a, y = regression.factors
    constant = a[:, regression.n_lengths :]  # of the bias, if there is one: always kept
    below = np.sqrt(ridge) * np.eye(regression.n_lengths)
    lengths = np.vstack([a[:, : regression.n_lengths], below])
    pad = ((0, len(below)), (0, 0))
    return METHODS[method](*_without(lengths, np.pad(y, pad), np.pad(constant, pad)), seed)


def sense_only(regression: Regression, springs: Order, ridge: float) -> Array:
    """Readout (L or L + 1, n_outputs) that reads only some springs: the others' rows are 0."""
    fit = regression.restricted(springs).solve(ridge)
    w_out = np.zeros((regression.n_lengths + len(fit.w_out) - len(springs), fit.w_out.shape[1]))
    w_out[springs] = fit.w_out[: len(springs)]
    w_out[regression.n_lengths :] = fit.w_out[len(springs) :]
    return w_out


def _without(a: Array, y: Array, constant: Array) -> tuple[Array, Array]:
    """What of a and y the constant column does not explain."""
    if constant.shape[1] == 0:
        return a, y
    unit = constant / np.linalg.norm(constant)
    return a - unit @ (unit.T @ a), y - unit @ (unit.T @ y)


def _backward(a: Array, y: Array, seed: int) -> Order:
    both = qr(np.hstack([a, y]), mode="r")[0][: sum(x.shape[1] for x in (a, y))]
    left = list(range(a.shape[1]))
    dropped = []
    while left:
        u, values, vt = svd(both[:, left], full_matrices=False)
        values = np.maximum(values, values[0] * np.finfo(float).eps * len(both))
        weights = vt.T @ ((u.T @ both[:, a.shape[1] :]) / values[:, None])
        spread = ((vt.T / values) ** 2).sum(axis=1)  # diagonal of (A^T A)^-1
        dropped.append(left.pop(int(((weights**2).sum(axis=1) / spread).argmin())))
    return np.array(dropped[::-1])


def _forward(a: Array, y: Array, seed: int) -> Order:
    rest, goal = a.copy(), y.copy()
    size = (a**2).sum(axis=0)
    order: list[int] = []
    while len(order) < a.shape[1]:
        norms = (rest**2).sum(axis=0)
        gain = ((rest.T @ goal) ** 2).sum(axis=1) / np.maximum(norms, 1e-24 * size)
        gain[order] = -1.0
        best = int(gain.argmax())
        order.append(best)
        unit = rest[:, best] / max(float(np.sqrt(norms[best])), np.finfo(float).tiny)
        for _ in range(2):  # twice is enough (Kahan, in Parlett 1980)
            rest -= np.outer(unit, unit @ rest)
            goal -= np.outer(unit, unit @ goal)
    return np.array(order)


def _random(a: Array, y: Array, seed: int) -> Order:
    return stream(seed, "pruning_order").permutation(a.shape[1])


METHODS: dict[str, Callable[[Array, Array, int], Order]] = {
    "backward": _backward,
    "forward": _forward,
    "random": _random,
}
