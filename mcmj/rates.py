"""Success rates with their uncertainty."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.stats import binomtest


def success_rate(good: Sequence[bool] | npt.NDArray[np.bool_]) -> dict[str, object]:
    """Counts of successes, and the 95 % Wilson interval of their probability."""
    count, total = int(np.sum(good)), len(good)
    interval = binomtest(count, total).proportion_ci(method="wilson")
    bounds = [float(interval.low), float(interval.high)]
    return {"successes": count, "of": total, "interval_95": bounds}
