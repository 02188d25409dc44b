"""How bodies come back from perturbations, and how many of them do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.perturb.config import Config
from mcmj.learning.regression import Fit
from mcmj.metrics.success_rates import success_rate
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Recovery:
    """One perturbation of one body.

    Attributes:
        times: (T,) [s], 0 at the start of the undisturbed phase; empty if it blew up.
        outputs: (T, n_outputs) as fed back: a frozen output is constant, a noisy one noisy.
        clean: (T, n_outputs) of the lengths without noise.
        boundaries: rows at which the phases begin, and T.
        orbit_error: of the last part, infinite if it blew up.
        recovery_time: from the end of the disturbance until the outputs stay within the
            tolerance of the orbit [s], infinite if they do not.
    """

    times: Array
    outputs: Array
    clean: Array
    boundaries: tuple[int, ...]
    orbit_error: float
    recovery_time: float


LOST = Recovery(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), (0,), np.inf, np.inf)


@dataclass(frozen=True)
class BodyResult:
    """One body under all perturbations; `noise_errors` (amplitudes,) is its tolerance curve."""

    body: Body
    source: dict[str, object]
    fit: Fit | None
    unperturbed_error: float
    recoveries: dict[str, Recovery]
    noise_errors: Array


@dataclass(frozen=True)
class Result:
    """All bodies; the first is drawn."""

    config: Config
    target: Target
    bodies: list[BodyResult]

    @property
    def body(self) -> Body:
        """The first body."""
        return self.bodies[0].body

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readout by task; empty if it blew up under the teacher."""
        fit = self.bodies[0].fit
        return {} if fit is None else {self.target.name: fit.w_out}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and counts over all seeds."""
        first, config = self.bodies[0], self.config
        table: dict[str, object] = {
            name: {"orbit_error": r.orbit_error, "recovery_time": r.recovery_time}
            for name, r in first.recoveries.items()
        }
        table["unperturbed"] = {"orbit_error": first.unperturbed_error}
        table["noise_curve"] = {
            "amplitudes": config.noise_curve,
            "orbit_errors": first.noise_errors,
            "recovered": [self._count([b.noise_errors[k] for b in self.bodies])
                          for k in range(len(config.noise_curve))],
        }  # fmt: skip
        if config.seeds > 1:
            rows = {name: self.over_seeds(name) for name in first.recoveries}
            errors = [body.unperturbed_error for body in self.bodies]
            table["seeds"] = rows | {"unperturbed": self._count(errors)}
        return table

    def over_seeds(self, name: str) -> dict[str, object]:
        """How many bodies recover from a perturbation, and how fast: the median of all."""
        of_all = [body.recoveries[name] for body in self.bodies]
        errors, times = [r.orbit_error for r in of_all], [r.recovery_time for r in of_all]
        return {
            **self._count(errors),
            "median_orbit_error": float(np.median(errors)),
            "median_recovery_time": float(np.median(times)),
            "orbit_errors": errors,
            "recovery_times": times,
        }

    def _count(self, errors: Sequence[float]) -> dict[str, object]:
        return success_rate([error < self.config.tolerance for error in errors])
