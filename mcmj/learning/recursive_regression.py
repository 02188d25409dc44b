"""From a regression of all samples so far to recursive least squares that goes on from there.

Signals are taken from their mean and over their standard deviation, so that one ridge means the
same in any units; the constant is not penalised. For features F = [(s - m) / d, 1] of n samples:

    P = (F^T F + ridge I')^(-1) = R R^T,   W = P F^T Y        (I' without the constant)

Nothing is squared: F and Y are the triangular factor of the regression, and R its SVD's V / s.
"""

import numpy as np
from scipy.linalg import svd

from mcmj.core.callbacks.online_learning import Learner
from mcmj.learning.regression import Regression
from mcmj.utils.validation import require_number

STILL = 1e-9  # standard deviation, over the mean, of a signal that says nothing


def learner_after(regression: Regression, ridge: float) -> Learner:
    """What a readout that is corrected sample by sample begins with.

    Args:
        regression: with a bias, of samples with weight 1.
        ridge: penalty of the squared weights, > 0; signals have variance 1.

    Raises:
        InvalidArgumentError: no samples, or a ridge that is not positive.
    """
    require_number("ridge", ridge, 0.0, open_low=True)
    factor, wanted = regression.factors
    n, rows = regression.n_lengths, regression.weight
    constant = factor[:, n]
    mean = factor[:, :n].T @ constant / rows
    apart = factor[:, :n] - np.outer(constant, mean)
    spread = np.linalg.norm(apart, axis=0) / np.sqrt(rows)
    moves = spread > STILL * np.abs(mean)
    inverse = np.divide(1.0, spread, out=np.zeros(n), where=moves)
    penalty = np.sqrt(ridge) * np.eye(n, n + 1)
    features = np.vstack([np.column_stack([apart * inverse, constant]), penalty])
    goal = np.vstack([wanted, np.zeros((n, wanted.shape[1]))])
    u, values, vt = svd(features, full_matrices=False)
    root = np.ascontiguousarray(vt.T / values)
    return Learner(root, np.ascontiguousarray((root @ (u.T @ goal)).T), mean, inverse)
