"""How bodies come back from perturbations, and how many of them do."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.perturb.config import Config
from mcmj.metrics.success_rates import success_rate
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

    @property
    def judged(self) -> "Recovery":
        """The same without its outputs: those of many bodies would fill the memory."""
        return replace(LOST, orbit_error=self.orbit_error, recovery_time=self.recovery_time)


LOST = Recovery(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), (0,), np.inf, np.inf)


@dataclass(frozen=True)
class TaskResult:
    """One task of one body under all perturbations.

    Attributes:
        w_out: its readout; None if it blew up under the teacher.
        recoveries: by perturbation; those of the first body with their outputs.
        noise_errors: (amplitudes,) its tolerance curve.
    """

    w_out: Array | None
    unperturbed_error: float
    recoveries: dict[str, Recovery]
    noise_errors: Array

    @property
    def blew_up(self) -> bool:
        """Under the teacher, or when it was disturbed."""
        return self.w_out is None or any(np.isinf(r.orbit_error) for r in self.recoveries.values())


@dataclass(frozen=True)
class Result:
    """The first body; the results of all, each a dictionary by task; the first is drawn."""

    config: Config
    body: Body
    bodies: list[dict[str, TaskResult]]

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readouts by task, of those that were taught."""
        tasks = self.bodies[0].items()
        return {name: task.w_out for name, task in tasks if task.w_out is not None}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: those of the task, or of each by its name."""
        tables = {name: self._metrics_of(name) for name in self.bodies[0]}
        return next(iter(tables.values())) if len(tables) == 1 else dict(tables)

    def _metrics_of(self, task: str) -> dict[str, object]:
        """The first body's numbers, and counts over all seeds."""
        of_all, config = [body[task] for body in self.bodies], self.config
        first = of_all[0]
        table: dict[str, object] = {
            name: {"orbit_error": r.orbit_error, "recovery_time": r.recovery_time}
            for name, r in first.recoveries.items()
        }
        table["unperturbed"] = {"orbit_error": first.unperturbed_error}
        table["noise_curve"] = {
            "amplitudes": config.noise_curve,
            "orbit_errors": first.noise_errors,
            "recovered": [self._count([one.noise_errors[k] for one in of_all])
                          for k in range(len(config.noise_curve))],
        }  # fmt: skip
        if config.seeds > 1:
            rows = {name: self.over_seeds(task, name) for name in first.recoveries}
            errors = [one.unperturbed_error for one in of_all]
            table["seeds"] = rows | {"unperturbed": self._count(errors)}
        return table

    def over_seeds(self, task: str, name: str) -> dict[str, object]:
        """How many bodies recover from a perturbation, and how fast: the median of all."""
        of_all = [body[task].recoveries[name] for body in self.bodies]
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
