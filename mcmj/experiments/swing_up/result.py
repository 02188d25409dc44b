"""How bodies swing up from rest, and how many of them do."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.swing_up.config import Config
from mcmj.metrics.success_rates import success_rate
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class SwingUp:
    """One task of one body.

    Attributes:
        timestep: of the simulation [s]; NaN if it blew up.
        outputs: (T, n_outputs) from rest, one every timestep; empty if it blew up, and of
            all bodies but the first, for they would fill the memory.
        orbit_error: of the last part; infinite if it blew up.
        swing_up_time: until the outputs stay within the tolerance of the orbit [s], infinite
            if they do not.
        w_out: the readout after practice; None if teaching blew up.
        practice_errors: of the trials, see mcmj.learning.practice; empty if teaching blew up.
        kicked_fraction: of the kicked starts, that came to the orbit; None without any.
    """

    target: Target
    w_out: Array | None
    timestep: float
    outputs: Array
    orbit_error: float
    swing_up_time: float
    practice_errors: tuple[float, ...]
    kicked_fraction: float | None


@dataclass(frozen=True)
class Result:
    """The first body; the results of all, each a dictionary by task; the first is drawn."""

    config: Config
    body: Body
    bodies: list[dict[str, SwingUp]]

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readouts by task, of those that were taught."""
        tasks = self.bodies[0].items()
        return {name: task.w_out for name, task in tasks if task.w_out is not None}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the worst task of the first body, each task, rates."""
        first = self.bodies[0]
        table: dict[str, object] = {
            "orbit_error": max(task.orbit_error for task in first.values()),
            "swing_up_time": max(task.swing_up_time for task in first.values()),
            "tasks": {
                name: {
                    "orbit_error": task.orbit_error,
                    "swing_up_time": task.swing_up_time,
                    "practice_errors": task.practice_errors,
                    "kicked_fraction": task.kicked_fraction,
                }
                for name, task in first.items()
            },
        }
        if self.config.seeds > 1:
            table["seeds"] = self.rates
        return table

    @property
    def rates(self) -> dict[str, dict[str, object]]:
        """How many bodies swing up, by task and on all tasks."""
        by_task = {name: [body[name] for body in self.bodies] for name in self.bodies[0]}
        table = {name: self._rate(runs) for name, runs in by_task.items()}
        good = [
            all(run.orbit_error < self.config.tolerance for run in body.values())
            for body in self.bodies
        ]
        table["all_tasks"] = success_rate(good)
        return table

    def _rate(self, runs: list[SwingUp]) -> dict[str, object]:
        tolerance = self.config.tolerance
        kicked = [run.kicked_fraction for run in runs if run.kicked_fraction is not None]
        return {
            **success_rate([run.orbit_error < tolerance for run in runs]),
            "median_swing_up_time": float(np.median([run.swing_up_time for run in runs])),
            "mean_kicked_fraction": float(np.mean(kicked)) if kicked else None,
            "orbit_errors": [run.orbit_error for run in runs],
            "rounds": [max(0, len(run.practice_errors) - 1) for run in runs],
            "kicked_fractions": kicked,
        }
