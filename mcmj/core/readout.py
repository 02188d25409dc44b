"""The readout, linear and static: all that is trained of a body.

    y = W^T s + b        signals s (n_signals,), W (n_signals, n_outputs), b (n_outputs,)

Hauser et al. 2012, Eq. 9, where s are the springs' lengths and b = 0. As one array, in files
and as the argument `w_out`, a readout is W, or W with b as one row more.
"""

from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from mcmj.core.body import Body
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array


@dataclass(frozen=True, eq=False)
class Readout:
    """Weights and bias; both may have the copies of an ensemble as their first axis.

    Attributes:
        weights: W (n_signals, n_outputs).
        bias: b (n_outputs,), in the units of the outputs.
    """

    weights: Array
    bias: Array

    @classmethod
    def of(cls, value: object, n_signals: int, n_outputs: int, name: str = "w_out") -> "Readout":
        """A readout in any of its forms, checked.

        Args:
            value: an array (n_signals, n_outputs), or with the bias as one row more; a tuple of
                the arrays W and b; a Readout; None: one that always says 0.
            n_signals, n_outputs: the shape that it must have.
            name: for the error.

        Raises:
            InvalidArgumentError: another shape, or NaN or infinity inside.
        """
        if value is None:
            value = np.zeros((n_signals, n_outputs))
        return cls.from_rows(readout_rows(value, n_signals, n_outputs, name), n_signals)

    @classmethod
    def from_rows(cls, rows: Array, n_signals: int) -> "Readout":
        """The readout of an array (.., n_signals or n_signals + 1, n_outputs) known to be good."""
        return cls(rows[..., :n_signals, :], rows[..., n_signals:, :].sum(axis=-2))

    @property
    def rows(self) -> Array:
        """One array (.., n_signals + 1, n_outputs), the bias last."""
        return np.concatenate([self.weights, self.bias[..., None, :]], axis=-2)

    def outputs(self, signals: Array) -> Array:
        """Outputs y (.., n_outputs) of signals (.., n_signals), fast.

        The last bits of a row may depend on how many rows there are, for BLAS sums them in
        blocks; those of `outputs_by_row` do not.
        """
        return signals @ self.weights + self.bias

    def outputs_by_row(self, signals: Array) -> Array:
        """Outputs y (.., T, n_outputs) of signals (.., T, n_signals), each row for itself."""
        across = np.ascontiguousarray(np.swapaxes(self.weights, -1, -2))
        found: Array = np.einsum("...tl,...cl->...tc", signals, across) + self.bias[..., None, :]
        return found

    def weighted(self, signals: Array) -> Array:
        """W^T s (T, n_outputs) of signals (T, n_signals), without bias: what noise becomes.

        Each row for itself, summed in the order of the signals.
        """
        found: Array = np.einsum("tl,lc->tc", signals, self.weights)
        return found


def readout_rows(value: object, n_signals: int, n_outputs: int, name: str = "w_out") -> Array:
    """A readout in any of its forms but None, as one array; see `Readout.of`.

    Returns:
        (n_signals, n_outputs), or (n_signals + 1, n_outputs) with the bias in the last row.

    Raises:
        InvalidArgumentError: another shape, or NaN or infinity inside.
    """
    if isinstance(value, Readout):
        value = value.rows
    elif is_pair(value):
        weights, bias = value
        weights = as_array(name, weights, (n_signals, n_outputs))
        value = np.vstack([weights, as_array(name, bias, (n_outputs,))])
    rows = as_array(name, value, (None, n_outputs))
    if len(rows) not in (n_signals, n_signals + 1):
        raise InvalidArgumentError(
            name, f"{n_signals} rows (or {n_signals + 1} with a bias)", f"shape {rows.shape}"
        )
    return rows


def is_pair(value: object) -> TypeGuard[tuple[Array, Array]]:
    """Whether a value is a tuple of an array of weights and one of a bias."""
    if not isinstance(value, tuple) or len(value) != 2:
        return False
    weights, bias = value
    both = isinstance(weights, np.ndarray) and isinstance(bias, np.ndarray)
    return both and (weights.ndim, bias.ndim) == (2, 1)


def checked_readout(body: Body, w_out: object, name: str = "w_out") -> Array:
    """A readout of a body's lengths as one array, (L, n_outputs) or (L + 1, n_outputs).

    Raises:
        InvalidArgumentError: another shape, or NaN or infinity inside.
    """
    return readout_rows(w_out, body.n_springs, body.n_outputs, name)
