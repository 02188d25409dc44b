"""How well numbers tell successes from failures: areas under ROC curves, cross-validated."""

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import rankdata

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_count

Good = npt.NDArray[np.bool_]
PENALTY = 1e-2  # on the squared weights of the logistic regression, per sample


def auc(values: Array, good: Good) -> float:
    """P(value of a success > value of a failure), ties count half: 0.5 tells nothing.

    The Mann-Whitney statistic U = R - n (n + 1) / 2 over n m, R the sum of the ranks of the n
    successes among all n + m.

    Raises:
        InvalidArgumentError: no success, or no failure.
    """
    n, m = int(good.sum()), int((~good).sum())
    if n == 0 or m == 0:
        raise InvalidArgumentError("good", "successes and failures", f"{n} and {m}")
    rank_sum = rankdata(values)[good].sum()
    return float((rank_sum - n * (n + 1) / 2) / (n * m))


def held_out_auc(table: Array, good: Good, folds: int = 5) -> float:
    """Mean area on samples that the fit has not seen, of a logistic regression on the columns.

        P(good) = 1 / (1 + exp(-(w . z + b))),   z: ranks of the columns, scaled to [-1, 1]

    With one column the fit is no more than the column's sign. Sample k is in fold k mod `folds`.

    Args:
        table: (M, n).
        good: (M,).

    Returns:
        NaN if a fold has no success or no failure.
    """
    require_count("folds", folds, 2)
    columns = as_array("table", table, (len(good), None))
    z = np.apply_along_axis(rankdata, 0, columns) * 2.0 / (len(good) + 1) - 1.0
    areas = []
    for fold in range(folds):
        out = np.arange(len(good)) % folds == fold
        if any(part.all() or not part.any() for part in (good[out], good[~out])):
            return float("nan")
        areas.append(auc(z[out] @ _logistic(z[~out], good[~out])[:-1], good[out]))
    return float(np.mean(areas))


def _logistic(z: Array, good: Good) -> Array:
    """Weights and bias (n + 1,) with the smallest penalised log loss."""
    signs = np.where(good, 1.0, -1.0)
    rows = np.column_stack([z, np.ones(len(z))])

    def loss(w: Array) -> tuple[float, Array]:
        margins = signs * (rows @ w)
        value = np.logaddexp(0.0, -margins).mean() + PENALTY * (w[:-1] ** 2).sum()
        slope = -(rows * (signs * expit(-margins))[:, None]).mean(axis=0)
        slope[:-1] += 2.0 * PENALTY * w[:-1]
        return float(value), slope

    found: Array = minimize(loss, np.zeros(rows.shape[1]), jac=True, method="L-BFGS-B").x
    return found
