"""What becomes of the gaits of a body: runs with their errors, and their tables."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.gaits.config import Config
from mcmj.learning.regression import Fit
from mcmj.metrics import gaits as gaitmetrics
from mcmj.metrics import orbits
from mcmj.metrics.success_rates import success_rate
from mcmj.targets.gaits import LEGS
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array

KINDS = ("free_run", "switch", "from_rest", "all")  # what a body may succeed in


@dataclass(frozen=True)
class GaitRun:
    """Outputs in one gait, and how far they are from it at the end.

    Attributes:
        outputs: (T, 4); empty if the body blew up, then the errors are infinite.
        errors: by name: orbit, period, phase lag and duty factor error of the last window.
        time: from the start of the run, or from the switch on, until the outputs stay within
            the tolerance of the gait (gaitmetrics.switching_time) [s]; infinite if they do not.
        switched: row at which the readout is switched.
        duty_factors, phase_lags: (4,) of the last window; NaN if it does not repeat.
    """

    outputs: Array
    errors: dict[str, float]
    time: float
    duty_factors: Array
    phase_lags: Array
    switched: int = 0

    @property
    def error(self) -> float:
        """The larger of orbit and period error: how far the run ends from its gait.

        The period counts because legs in phase or antiphase draw the same line in the space of
        the outputs at any pace.
        """
        return max(self.errors["orbit_error"], self.errors["period_error"])


@dataclass(frozen=True)
class Taught:
    """One gait of one body: its readout (None if teaching blew up), the fit if it was taught."""

    target: Target
    w_out: Array | None
    fit: Fit | None
    free: GaitRun
    from_rest: GaitRun


@dataclass(frozen=True)
class BodyResult:
    """One body: its gaits, and the switches between them by (from, to).

    Attributes:
        stepping: arguments of the Simulation.
    """

    body: Body
    source: dict[str, object]
    stepping: dict[str, Any]
    gaits: dict[str, Taught]
    switches: dict[tuple[str, str], GaitRun]

    @property
    def metrics(self) -> dict[str, object]:
        """Errors by gait, and by switch."""
        table: dict[str, object] = {}
        for name, gait in self.gaits.items():
            fit, rest = gait.fit, gait.from_rest
            table[name] = {
                **gait.free.errors,
                "period": gait.target.period,
                "duty_factor": gait.free.duty_factors,
                "phase_lags": gait.free.phase_lags,
                "from_rest": {**rest.errors, "swing_up_time": rest.time},
                "train_nrmse": fit.train_nrmse if fit else None,
                "condition_number": fit.condition_number if fit else None,
            }
        table["switch"] = {
            f"{first}_to_{second}": {**run.errors, "switching_time": run.time}
            for (first, second), run in self.switches.items()
        }
        table["worst_error"] = self.worst_error
        return table

    @property
    def worst_error(self) -> dict[str, float]:
        """The largest error of all free runs, of all switches and of all runs from rest."""
        runs = {
            "free_run": [gait.free for gait in self.gaits.values()],
            "switch": list(self.switches.values()),
            "from_rest": [gait.from_rest for gait in self.gaits.values()],
        }
        return {kind: max((run.error for run in some), default=0.0) for kind, some in runs.items()}

    def successes(self, tolerance: float) -> dict[str, bool]:
        """Whether all free runs, all switches and all runs from rest end in the gait."""
        good = {kind: error < tolerance for kind, error in self.worst_error.items()}
        return {**good, "all": all(good.values())}


@dataclass(frozen=True)
class Result:
    """The first body with its outputs, and the outcomes of all, one a seed."""

    config: Config
    first: BodyResult
    outcomes: list[dict[str, object]]

    @property
    def body(self) -> Body:
        """The first body."""
        return self.first.body

    @property
    def stepping(self) -> dict[str, Any]:
        """Arguments of the first body's Simulation."""
        return self.first.stepping

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readouts by gait, of those that it has."""
        gaits = self.first.gaits.items()
        return {name: gait.w_out for name, gait in gaits if gait.w_out is not None}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and counts over all seeds."""
        table = self.first.metrics
        if self.config.seeds > 1:
            table["seeds"] = self.rates
        return table

    @property
    def rates(self) -> dict[str, object]:
        """How many bodies run all gaits, make all switches, start from rest, do all of it."""
        table: dict[str, object] = {
            kind: success_rate([bool(one[kind]) for one in self.outcomes]) for kind in KINDS
        }
        table["outcomes"] = self.outcomes
        return table


def outcome(result: BodyResult, seed: int, tolerance: float) -> dict[str, object]:
    """What is kept of a body: what it managed, its worst errors, and the switches it missed."""
    free = [gait.free.errors for gait in result.gaits.values()]
    switches = result.switches
    return {
        "seed": seed,
        **result.successes(tolerance),
        "worst_orbit_error": max(errors["orbit_error"] for errors in free),
        "worst_period_error": max(errors["period_error"] for errors in free),
        "worst_phase_lag_error": max(errors["phase_lag_error"] for errors in free),
        "worst_switch_error": max(
            (run.errors["orbit_error"] for run in switches.values()), default=0
        ),
        "worst_switching_time": max((run.time for run in switches.values()), default=0),
        "switches_missed": [
            f"{a}_to_{b}" for (a, b), run in switches.items() if run.error >= tolerance
        ],
    }


def measure(config: Config, outputs: Array, wanted: Target, *, switched: int = 0) -> GaitRun:
    """Outputs with their errors at the end, and the time that they took to the gait."""
    step = config.timestep
    duties = lags = np.full(len(LEGS), np.nan)
    orbit_error, period, time = np.inf, np.nan, np.inf
    if len(outputs):
        last = outputs[-round(config.window / step) :]
        orbit_error = orbits.orbit_error(last, wanted)
        period = orbits.period_or_nan(last, step, wanted)
        time = gaitmetrics.switching_time(
            outputs[switched:], step, wanted, tolerance=config.tolerance
        )
        if not np.isnan(period):
            duties = gaitmetrics.duty_factors(last, step, period)
            lags = gaitmetrics.phase_lags(last, step, period)
    errors = {
        "orbit_error": orbit_error,
        "period_error": np.inf if np.isnan(period) else abs(period / wanted.period - 1.0),
        "phase_lag_error": gaitmetrics.phase_lag_error(lags, wanted),
        "duty_factor_error": gaitmetrics.duty_factor_error(duties, wanted),
    }
    return GaitRun(outputs, errors, time, duties, lags, switched)
