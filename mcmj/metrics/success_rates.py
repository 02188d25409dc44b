"""Success rates with their uncertainty."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri


def success_rate(good: Sequence[bool] | npt.NDArray[np.bool_]) -> dict[str, object]:
    """Counts of successes, and the 95 % Wilson interval of their probability."""
    count, total = int(np.sum(good)), len(good)
    return {"successes": count, "of": total, "interval_95": list(wilson_interval(count, total))}


def wilson_interval(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's interval of a probability (1927), from so many successes of a total > 0.

    scipy.stats has it too, and takes a second to import.
    """
    z = float(ndtri(0.5 + 0.5 * level))
    middle = (count + z**2 / 2) / (total + z**2)
    reach = z / (total + z**2) * np.sqrt(count * (total - count) / total + z**2 / 4)
    low = 0.0 if count == 0 else float(middle - reach)
    return low, 1.0 if count == total else float(middle + reach)


def rate_cells(row: Mapping[str, object]) -> tuple[str, str]:
    """A success rate for a table: "46 of 50", "0.812 to 0.968"."""
    low, high = np.asarray(row["interval_95"])
    return f"{row['successes']} of {row['of']}", f"{low:.3f} to {high:.3f}"
