"""Linear static readouts: least squares and ridge regression, without normal equations."""

import copy
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import svd

from mcmj.learning.fold import fold
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.threads import one_blas_thread
from mcmj.utils.validation import Array, as_array, require_above, require_number


@dataclass(frozen=True)
class Fit:
    """A fitted readout and how well posed it was.

    Attributes:
        w_out: (L, n_outputs), or (L + 1, n_outputs) with the bias in the last row.
        train_nrmse: root mean square error on the rows fitted, over the targets' standard
            deviation, all outputs together, both weighted as the rows are.
        rank: number of singular values of the data above the rounding error.
        condition_number: largest over smallest singular value of the data.
        rows: number of samples fitted.
    """

    w_out: Array
    train_nrmse: float
    rank: int
    condition_number: float
    rows: int


class Regression:
    """Least squares over any number of rows in the memory of one chunk.

    Keeps only the triangular factor R of the QR decomposition of [lengths, (1,) targets] and
    folds every new chunk into it: QR([R; chunk]). Nothing is squared, so a condition number
    of 1e8 costs 8 digits and not 16. For S = [A, Y] with R = [[R_A, Q^T Y], [0, E]]:

        minimise |A W - Y|^2 + ridge |W|^2

    by the SVD of R_A; |E| is the part of Y that no W reaches. The bias is not penalised.

    Args:
        bias: fit a constant too.
    """

    def __init__(self, *, bias: bool = False) -> None:
        self._bias = bias
        self._factor: Array | None = None
        self._n_lengths = 0
        self._rows = 0
        self._weight = 0.0  # sum over the rows
        self._mean = np.zeros(0)  # of the targets, and their summed squares about it
        self._scatter = 0.0

    @property
    def weight(self) -> float:
        """Sum of the weights of all rows so far: their number where every weight is 1."""
        return self._weight

    @property
    def n_lengths(self) -> int:
        """L, once there are samples."""
        return self._n_lengths

    @property
    def factors(self) -> tuple[Array, Array]:
        """Matrices (n, L) and (n, n_outputs) with the same regression as all the samples.

        With a bias, the first has one column more, the last: the constant's.
        """
        factor = self._checked_factor()
        n = self._n_lengths + int(self._bias)
        return np.roll(factor[:, :n], -int(self._bias), axis=1), factor[:, n:]

    def restricted(self, springs: npt.NDArray[np.int64]) -> "Regression":
        """The same regression, of the same samples, on some of the lengths only."""
        factor, first = self._checked_factor(), int(self._bias)
        kept = [*range(first), *(first + np.asarray(springs))]
        targets = range(first + self._n_lengths, factor.shape[1])
        part = copy.copy(self)
        part._n_lengths = len(springs)
        with one_blas_thread():
            part._factor = np.asarray(np.linalg.qr(factor[:, [*kept, *targets]], mode="r"))
        return part

    def _checked_factor(self) -> Array:
        if self._factor is None or self._rows == 0:
            raise InvalidArgumentError("lengths", "at least one sample", 0)
        return self._factor

    def add(self, lengths: Array, targets: Array, *, weight: float | Array = 1.0) -> None:
        """Fold in samples: lengths (M, L) and targets (M, n_outputs).

        Args:
            weight: of their squared errors, > 0: a number, or (M,).

        Raises:
            InvalidArgumentError: wrong shapes, NaN, or a weight that is not positive.
        """
        x = as_array("lengths", lengths, (None, None))
        y = as_array("targets", targets, (len(x), None))
        weights = as_array("weight", np.broadcast_to(weight, len(x)), (len(x),))
        require_above("weight", weights, 0.0)
        ones = np.ones((len(x), int(self._bias)))
        block = np.hstack([ones, x, y])
        if (weights != 1.0).any():
            block *= np.sqrt(weights)[:, None]
        if self._factor is None:
            self._n_lengths = x.shape[1]
            self._factor = np.zeros((0, block.shape[1]))
            self._mean = np.zeros(y.shape[1])
        elif x.shape[1] != self._n_lengths:
            raise InvalidArgumentError("lengths", f"{self._n_lengths} columns", x.shape[1])
        elif y.shape[1] != len(self._mean):
            raise InvalidArgumentError("targets", f"{len(self._mean)} columns", y.shape[1])
        with one_blas_thread():  # the same bits on any number of cores
            self._factor = fold(self._factor, block)
            self._count(y, weights)
        self._rows += len(y)

    def _count(self, y: Array, weights: Array) -> None:
        """Merge mean and scatter of new targets (Chan et al. 1979): large means do no harm."""
        before, new = self._weight, float(weights.sum())
        if new == 0:
            return
        mean = weights @ y / new
        shift = mean - self._mean
        self._weight = before + new
        scatter = (weights @ (y - mean) ** 2).sum()
        self._scatter += scatter + (shift**2).sum() * before * new / self._weight
        self._mean = self._mean + shift * new / self._weight

    def solve(self, ridge: float = 0.0) -> Fit:
        """The readout for a ridge parameter >= 0.

        A ridge of rows * s^2 does what white noise of standard deviation s [m] on the lengths
        would do.

        Raises:
            InvalidArgumentError: no samples, or a negative ridge.
        """
        require_number("ridge", ridge, 0.0)
        factor = self._checked_factor()
        n_unknowns = self._n_lengths + int(self._bias)
        top, reached = factor[:, :n_unknowns], factor[:, n_unknowns:]
        with one_blas_thread():
            weights, values = self._minimise(top, reached, ridge)
            residual = reached - top @ weights
        rank = int((values > values[0] * max(self._rows, n_unknowns) * np.finfo(float).eps).sum())
        return Fit(
            w_out=np.roll(weights, -1, axis=0) if self._bias else weights,
            train_nrmse=(
                float(np.sqrt((residual**2).sum() / self._scatter)) if self._scatter > 0 else np.inf
            ),
            rank=rank,
            condition_number=_condition_number(values, n_unknowns),
            rows=self._rows,
        )

    def _minimise(self, top: Array, reached: Array, ridge: float) -> tuple[Array, Array]:
        """Weights, and the singular values of the data."""
        u, values, vt = svd(top, full_matrices=False)
        cut = values[0] * max(self._rows, top.shape[1]) * np.finfo(float).eps
        if ridge == 0.0:
            kept = values > cut
            return vt[kept].T @ ((u.T @ reached)[kept] / values[kept, None]), values
        penalty = np.sqrt(ridge) * np.eye(top.shape[1])
        if self._bias:
            penalty[0, 0] = 0.0
        stacked = np.vstack([top, penalty])
        goal = np.vstack([reached, np.zeros((len(penalty), reached.shape[1]))])
        u, damped, vt = svd(stacked, full_matrices=False)
        return vt.T @ ((u.T @ goal) / damped[:, None]), values


def _condition_number(values: Array, unknowns: int) -> float:
    """Of a matrix with that many columns and these singular values, largest first."""
    if len(values) < unknowns or values[-1] == 0.0:
        return np.inf
    return float(values[0] / values[-1])


def fit_readout(lengths: Array, targets: Array, ridge: float = 0.0, *, bias: bool = False) -> Array:
    """Readout W minimising |lengths W - targets|^2 + ridge |W|^2.

    Without a bias, as the paper's readout (Hauser et al. 2012, Eq. 9); `ridge` is 0 unless
    given: plain least squares.

    Args:
        lengths: (M, L).
        targets: (M, n_outputs).

    Returns:
        (L, n_outputs), or (L + 1, n_outputs) with the bias in the last row.

    Raises:
        InvalidArgumentError: wrong shapes, NaN, a negative ridge.
    """
    regression = Regression(bias=bias)
    regression.add(lengths, targets)
    return regression.solve(ridge).w_out
