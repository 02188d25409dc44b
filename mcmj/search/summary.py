"""What a search says about each setting: success rates, with their uncertainty."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from mcmj.metrics.success_rates import success_rate
from mcmj.search.space import Range, Space

BINS = 6  # of a random range


def success_by_setting(
    space: Space, settings: Sequence[Mapping[str, object]], good: npt.NDArray[np.bool_]
) -> dict[str, list[dict[str, object]]]:
    """Success rates against each varied field, over all values of the others.

    Args:
        space: what was varied.
        settings: (S,) values by path.
        good: (S, seeds) whether a trial was a success.

    Returns:
        By path, one row a value (or bin of a random range, with as many settings as the
        others): value, a number, text or list; low and high of a bin; the counts and interval
        of mcmj.metrics.success_rates.success_rate.
    """
    table: dict[str, list[dict[str, object]]] = {}
    for path, part in space.items():
        values = [setting[path] for setting in settings]
        groups = _bins(values) if isinstance(part, Range) else _groups(values)
        table[path] = [row | success_rate(good[rows].ravel()) for row, rows in groups]
    return table


def _groups(values: Sequence[object]) -> list[tuple[dict[str, object], npt.NDArray[np.int64]]]:
    distinct: list[object] = []
    for value in values:
        if value not in distinct:
            distinct.append(value)
    return [
        ({"value": value}, np.flatnonzero([other == value for other in values]))
        for value in distinct
    ]


def _bins(values: Sequence[object]) -> list[tuple[dict[str, object], npt.NDArray[np.int64]]]:
    numbers = np.array(values, dtype=np.float64)
    order = np.argsort(numbers, kind="stable")
    rows = [part for part in np.array_split(order, BINS) if part.size]
    return [
        (
            {
                "value": float(np.median(numbers[part])),
                "low": float(numbers[part].min()),
                "high": float(numbers[part].max()),
            },
            part,
        )
        for part in rows
    ]
