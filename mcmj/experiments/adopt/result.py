"""What models learned, and what they are worth."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mcmj.analysis.capacities import Worth
from mcmj.experiments.adopt.config import Config
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array

RUNS = ("free", "from_rest", "after_freeze", "after_kick")


@dataclass(frozen=True)
class Trial:
    """One readout; orbit errors of the last part of runs, infinite where one blew up.

    Attributes:
        seed: of the teacher's noise.
        train_nrmse: of the regression.
        rounds: of practice.
        free: from the end of the teaching.
        from_rest: from the model's start.
        after_freeze: the last output was held for a period.
        after_kick: every speed was changed at random, by its own RMS value.
        recovery: from the kick until the outputs stay within 10 % of the orbit [s].
        period_error: |T - T*| / T* of the free run.
    """

    seed: int
    train_nrmse: float = np.inf
    rounds: int = 0
    free: float = np.inf
    from_rest: float = np.inf
    after_freeze: float = np.inf
    after_kick: float = np.inf
    recovery: float = np.inf
    period_error: float = np.inf


@dataclass(frozen=True)
class Motion:
    """The first readout at work: times (T,) [s], joints (T, nq), outputs (T, n_outputs)."""

    times: Array
    qpos: Array
    outputs: Array


@dataclass(frozen=True)
class Adopted:
    """One model.

    Attributes:
        reservoir: with the first readout.
        largest_control: of any actuator of the free run, over its range; above 1 it is cut.
        motion: the end of the free run; None if the model blew up under the teacher.
        worth: None if not measured.
    """

    reservoir: Reservoir
    n_actuators: int
    target: Target
    trials: tuple[Trial, ...]
    largest_control: float
    motion: Motion | None
    worth: Worth | None

    def errors(self, run: str) -> Array:
        """(seeds,) orbit errors of one of RUNS."""
        return np.array([getattr(trial, run) for trial in self.trials])

    def metrics(self, threshold: float) -> dict[str, object]:
        """As written to metrics.json."""
        found: dict[str, Any] = {
            "task": self.target.name,
            "period": self.target.period,
            "timestep": self.reservoir.timestep,
            "n_signals": self.reservoir.n_signals,
            "n_actuators": self.n_actuators,
            "largest_control": self.largest_control,
        }
        for run in RUNS:
            errors = self.errors(run)
            found[run] = {
                "successes": int((errors < threshold).sum()),
                "median_orbit_error": float(np.median(errors)),
                "worst_orbit_error": float(errors.max()),
            }
        found["median_recovery"] = float(np.median(self.errors("recovery")))
        found["median_period_error"] = float(np.median(self.errors("period_error")))
        if self.worth is not None:
            found |= {"rank": self.worth.capacities.rank, **self.worth.measures}
        return found | {"trials": [asdict(trial) for trial in self.trials]}


@dataclass(frozen=True)
class Result:
    """All models, by name."""

    config: Config
    adopted: Mapping[str, Adopted] = field(default_factory=dict)

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        return {name: one.metrics(self.config.threshold) for name, one in self.adopted.items()}
