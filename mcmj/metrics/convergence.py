"""Observed order of convergence: the slope of log error over log step."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

ROUNDING = 1e-11  # errors near the reference's own are left out
ROUGH = 2e-2  # and so are errors too large for the leading term
FINEST = 4  # of the usable steps, only the finest count: there the leading term rules


class HasError(Protocol):
    """Anything with an error."""

    @property
    def error(self) -> float:
        """Relative error."""


@dataclass(frozen=True)
class Order:
    """Median slope over the bodies, and the range of steps [ms] that it was fitted on."""

    slope: float
    steps_ms: tuple[float, float]


def observed_order(
    cells: Mapping[str, Mapping[str, Mapping[float, HasError]]], method: str
) -> Order | None:
    """The method's order over all bodies with at least three usable steps; None without one."""
    slopes, used = [], []
    for methods in cells.values():
        errors = {step: cell.error for step, cell in methods[method].items()}
        usable = sorted(step for step, e in errors.items() if ROUNDING < e < ROUGH)[:FINEST]
        if len(usable) >= 3:
            logs = np.log([[step, errors[step]] for step in usable])
            slopes.append(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])
            used += [usable[0], usable[-1]]
    return Order(float(np.median(slopes)), (min(used), max(used))) if slopes else None
