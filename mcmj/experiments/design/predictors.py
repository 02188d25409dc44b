"""Which measure of a random body before teaching tells whether it will learn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mcmj.metrics.separation import auc, held_out_auc
from mcmj.metrics.success_rates import success_rate
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

TOGETHER = "together"


@dataclass(frozen=True)
class Predictors:
    """Random bodies measured, then taught.

    Attributes:
        bodies: the metrics of every trial that could be measured.
        threshold: largest orbit error of a success.
    """

    bodies: Sequence[Mapping[str, Any]]
    threshold: float

    @cached_property
    def good(self) -> np.ndarray:
        """(bodies,) which learned."""
        errors = [body["orbit_error"] for body in self.bodies]
        return np.array([error is not None and error < self.threshold for error in errors])

    @property
    def successes(self) -> int:
        """How many learned."""
        return int(self.good.sum())

    @cached_property
    def columns(self) -> dict[str, Array]:
        """(bodies,) of each measure."""
        names = self.bodies[0]["measures"]
        return {n: np.array([body["measures"][n] for body in self.bodies]) for n in names}

    @cached_property
    def held_out(self) -> dict[str, float]:
        """Areas on bodies that the fit has not seen: each measure, and all of them together."""
        areas = {n: held_out_auc(x[:, None], self.good) for n, x in self.columns.items()}
        areas[TOGETHER] = held_out_auc(np.column_stack(list(self.columns.values())), self.good)
        return areas

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types; an area above 0.5 in `auc`: large is good."""
        return {
            **success_rate(self.good),
            "auc": {name: self._auc(values) for name, values in self.columns.items()},
            "held_out_auc": self.held_out,
        }

    def _auc(self, values: Array) -> float:
        try:
            return auc(values, self.good)
        except InvalidArgumentError:  # all learned, or none
            return float("nan")
