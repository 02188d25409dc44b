"""Exact or robust: what designs reach, and as many random bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Fronts:
    """Trade-offs of consecutive seeds.

    Attributes:
        bodies: the metrics of every trial.
        threshold: largest orbit error of a success.
    """

    bodies: Sequence[Mapping[str, Any]]
    threshold: float

    def least(self, kind: str) -> Array:
        """(bodies,) the smallest error with noise among those below the threshold without."""
        return np.array([self._least(body[kind]) for body in self.bodies])

    def _least(self, points: Sequence[Sequence[float]]) -> float:
        return min((noisy for quiet, noisy in points if quiet < self.threshold), default=np.inf)

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types."""
        table: dict[str, object] = {"of": len(self.bodies)}
        for kind in ("random", "designed"):
            errors = self.least(kind)
            table[kind] = {
                "successes": int((errors < self.threshold).sum()),
                "median_error_with_noise": float(np.median(errors)),
                "errors_with_noise": errors,
                "fronts": [body[kind] for body in self.bodies],
            }
        return table
