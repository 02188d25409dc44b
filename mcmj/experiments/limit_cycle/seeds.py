"""How many random bodies learn the limit cycles: the same settings, consecutive seeds."""

from dataclasses import dataclass

import numpy as np

from mcmj.metrics.success_rates import success_rate
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class SuccessOfSeeds:
    """Errors (seeds,) by task; infinite where a body blew up."""

    first_seed: int
    threshold: float
    orbit_errors: dict[str, Array]
    period_errors: dict[str, Array]

    @property
    def best_seed(self) -> int:
        """Seed of the body whose worst orbit error over the tasks is the smallest."""
        worst = np.max(list(self.orbit_errors.values()), axis=0)
        return self.first_seed + int(worst.argmin())

    @property
    def metrics(self) -> dict[str, dict[str, object]]:
        """Rates with their 95 % Wilson intervals, and median errors; `all_tasks` by one body."""
        successes = {n: e < self.threshold for n, e in self.orbit_errors.items()}
        table: dict[str, dict[str, object]] = {
            name: {
                **success_rate(good),
                "median_orbit_error": float(np.median(self.orbit_errors[name])),
                "median_period_error": float(np.median(self.period_errors[name])),
                "orbit_errors": self.orbit_errors[name],
            }
            for name, good in successes.items()
        }
        table["all_tasks"] = success_rate(np.logical_and.reduce(list(successes.values())))
        return table
