"""How many random bodies learn the three limit cycles: the same settings, consecutive seeds."""

from dataclasses import dataclass, field

import numpy as np

from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.learning.lessons import Teaching
from mcmj.targets.limit_cycles import TARGETS
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.success_rates import success_rate
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        seeds: number of bodies.
        first_seed: their seeds are consecutive from here.
        threshold: largest orbit error of a success.
        free_run: length of each free run in closed loop [s].
        window: the errors are those of this last part of it [s].
        settings: what the bodies are drawn from.
        teaching: how the readouts are taught.
    """

    seeds: int = 50
    first_seed: int = 0
    threshold: float = 0.05
    free_run: float = 60.0
    window: float = 20.0
    settings: BodySettings = field(default_factory=BodySettings)
    teaching: Teaching = field(default_factory=Teaching)

    def __post_init__(self) -> None:
        require_count("seeds", self.seeds, 1)
        require_seed("first_seed", self.first_seed)
        require_duration("free_run", self.free_run)
        require_number("window", self.window, 0.0, self.free_run, open_low=True)
        require_number("threshold", self.threshold, 0.0, open_low=True)

    def of_seed(self, seed: int) -> limit_cycle.Config:
        """The limit-cycle experiment of one body."""
        return limit_cycle.Config(
            seed=seed,
            free_run=self.free_run,
            window=self.window,
            settings=self.settings,
            teaching=self.teaching,
        )


@dataclass(frozen=True)
class Result:
    """Errors (seeds,) by task; infinite where a body blew up."""

    config: Config
    orbit_errors: dict[str, Array]
    period_errors: dict[str, Array]

    @property
    def best_seed(self) -> int:
        """Seed of the body whose worst orbit error over the tasks is the smallest."""
        worst = np.max(list(self.orbit_errors.values()), axis=0)
        return self.config.first_seed + int(worst.argmin())

    @property
    def metrics(self) -> dict[str, object]:
        """Rates with their 95 % Wilson intervals, and median errors."""
        successes = {n: e < self.config.threshold for n, e in self.orbit_errors.items()}
        table: dict[str, object] = {
            name: {
                **success_rate(good),
                "median_orbit_error": float(np.median(self.orbit_errors[name])),
                "median_period_error": float(np.median(self.period_errors[name])),
                "orbit_errors": self.orbit_errors[name],
            }
            for name, good in successes.items()
        }
        table["best_seed"] = self.best_seed
        table["all_tasks"] = success_rate(np.logical_and.reduce(list(successes.values())))
        return table


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach and run every body on all tasks; a body that blows up counts as a failure."""
    orbit = {name: np.full(config.seeds, np.inf) for name in TARGETS}
    period = {name: np.full(config.seeds, np.inf) for name in TARGETS}
    for index in range(config.seeds):
        one = config.of_seed(config.first_seed + index)
        for name, outcome in limit_cycle.run_tasks(one, limit_cycle.get_body(one)).items():
            if not isinstance(outcome, DivergenceError):
                orbit[name][index] = outcome.errors["orbit_error"]
                period[name][index] = outcome.errors["period_error"]
        on_steps(1)
    return Result(config, orbit, period)
