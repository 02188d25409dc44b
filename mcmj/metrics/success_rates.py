"""Success rates with their uncertainty."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.stats import binomtest


def success_rate(good: Sequence[bool] | npt.NDArray[np.bool_]) -> dict[str, object]:
    """Counts of successes, and the 95 % Wilson interval of their probability."""
    count, total = int(np.sum(good)), len(good)
    interval = binomtest(count, total).proportion_ci(method="wilson")
    bounds = [float(interval.low), float(interval.high)]
    return {"successes": count, "of": total, "interval_95": bounds}


def rate_cells(row: Mapping[str, object]) -> tuple[str, str]:
    """A success rate for a table: "46 of 50", "0.812 to 0.968"."""
    low, high = np.asarray(row["interval_95"])
    return f"{row['successes']} of {row['of']}", f"{low:.3f} to {high:.3f}"
