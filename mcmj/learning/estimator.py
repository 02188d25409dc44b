"""The readout as an estimator of scikit-learn, for its pipelines and searches; extra "sklearn".

GridSearchCV(ReadoutRegressor(bias=True), {"ridge": [0, 1e-6, 1e-3]}, cv=TimeSeriesSplit())
"""

from typing import Self

import numpy as np
import numpy.typing as npt

from mcmj.core.readout import Readout
from mcmj.learning.regression import fit_readout
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array, require_number

with extra("sklearn", "the readout as an estimator needs scikit-learn"):
    from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
    from sklearn.utils.validation import check_is_fitted, validate_data


class ReadoutRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """y = W^T s + b, W and b minimising |S W + b - Y|^2 + ridge |W|^2, without normal equations.

    As `mcmj.fit_readout` (Hauser et al. 2012, Eq. 9, without ridge and bias). Rows are taken as
    they come: cut a washout off before. `score` is R^2.

    Args:
        ridge: >= 0, not per row.
        bias: fit b too; else b = 0.

    Attributes:
        w_out_: (n_signals, n_outputs), or one row more with the bias last: what a Simulation or a
            Reservoir takes as w_out.
        n_features_in_: n_signals.
    """

    def __init__(self, ridge: float = 0.0, bias: bool = False) -> None:
        self.ridge = ridge
        self.bias = bias

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike) -> Self:
        """Fit signals X (M, n_signals) to targets y (M,) or (M, n_outputs).

        Raises:
            InvalidArgumentError: a negative ridge.
            ValueError: wrong shapes, NaN, too few samples, as scikit-learn says it.
        """
        require_number("ridge", self.ridge, 0.0)
        signals, targets = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True
        )
        self._one = targets.ndim == 1
        columns = targets[:, None] if self._one else targets
        self.w_out_ = fit_readout(signals, columns, self.ridge, bias=self.bias)
        return self

    def predict(self, X: npt.ArrayLike) -> Array:
        """Outputs (M,) or (M, n_outputs), as the targets were, of signals (M, n_signals).

        Raises:
            NotFittedError, ValueError: as scikit-learn says it.
        """
        check_is_fitted(self)
        signals = validate_data(self, X, dtype=np.float64, reset=False)
        found = Readout.from_rows(self.w_out_, self.n_features_in_).outputs(signals)
        return found[:, 0] if self._one else found
