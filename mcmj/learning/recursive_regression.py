"""Ridge regression, one sample at a time: recursive least squares.

    g = P f,   W <- W + g (y - W^T f)^T / (1 + f^T g),   P <- P - g g^T / (1 + f^T g)

from P = 1 / ridge and W = 0. After n samples W minimises sum_i |y_i - W^T f_i|^2 + ridge |W|^2,
as a batch would (Haykin, Adaptive Filter Theory, chapter on recursive least squares).
"""

import numpy as np

from mcmj.utils.validation import Array, require_count, require_number


class RecursiveLeastSquares:
    """A linear map that is right about every sample as it comes.

    Args:
        n_features: number of f.
        n_outputs: number of y.
        ridge: penalty of the squared weights, > 0, in squared units of f.

    Raises:
        InvalidArgumentError: an argument out of bounds.
    """

    def __init__(self, n_features: int, n_outputs: int, *, ridge: float) -> None:
        require_count("n_features", n_features, 1)
        require_count("n_outputs", n_outputs, 1)
        require_number("ridge", ridge, 0.0, open_low=True)
        self._inverse = np.eye(n_features) / ridge
        self.weights = np.zeros((n_features, n_outputs))

    def update(self, features: Array, wanted: Array) -> Array:
        """Learn one sample, f (n_features,) and y (n_outputs,); returns the error it came with."""
        gain = self._inverse @ features
        share = 1.0 + features @ gain
        error = self.weights.T @ features - wanted
        self.weights = self.weights - np.outer(gain / share, error)
        self._inverse -= np.outer(gain / share, gain)
        return error
