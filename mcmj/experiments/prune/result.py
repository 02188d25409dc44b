"""Errors of readouts of fewer and fewer springs."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.prune.config import Config
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Pruned:
    """One body.

    Attributes:
        orders: (L,) by method: springs, the most important first.
        errors: (counts,) by method: orbit errors in closed loop, the worst over the starts.
        full_error: with all springs.
    """

    body: Body
    orders: dict[str, np.ndarray]
    errors: dict[str, Array]
    full_error: float


@dataclass(frozen=True)
class Result:
    """All bodies; the first is drawn."""

    config: Config
    bodies: list[Pruned]

    @property
    def full_errors(self) -> Array:
        """(bodies,) with all springs."""
        return np.array([body.full_error for body in self.bodies])

    def errors(self, method: str) -> Array:
        """(bodies, counts)."""
        return np.array([body.errors[method] for body in self.bodies])

    def needed(self, method: str, index: int) -> int | None:
        """Fewest springs with which a body, and with more of them too, is a success."""
        one = self.bodies[index]
        counts = np.minimum([*self.config.counts, one.body.n_springs], one.body.n_springs)
        errors = np.append(one.errors[method], one.full_error)
        order = np.argsort(counts, kind="stable")[::-1]
        good = errors[order] < self.config.threshold
        run = len(good) if good.all() else int(good.argmin())
        return int(counts[order][run - 1]) if run else None

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        n = len(self.bodies)
        table: dict[str, object] = {
            "counts": self.config.counts,
            "springs": [one.body.n_springs for one in self.bodies],
            "full_errors": self.full_errors,
        }
        for method in self.config.methods:
            errors = self.errors(method)
            table[method] = {
                "median_orbit_errors": np.median(errors, axis=0),
                "successes": (errors < self.config.threshold).sum(axis=0),
                "springs_needed": [self.needed(method, k) for k in range(n)],
                "order": self.bodies[0].orders[method],
                "orbit_errors": errors,
            }
        return table
