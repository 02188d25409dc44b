"""What the input-driven experiment finds: one input, one body, all bodies; metrics of each."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.input_driven.config import Config, Start
from mcmj.experiments.input_driven.sweep import Sweep
from mcmj.learning.practice import Practised
from mcmj.metrics import orbits
from mcmj.metrics.success_rates import success_rate
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Held:
    """The closed loop at a constant input, from the state after teaching.

    Attributes:
        target: limit cycle at that input.
        outputs: (T, n_outputs) from the jump on; empty if the body blew up.
        orbit_error: of the last part, as all below; infinite if it blew up.
        amplitude_error: largest over the outputs of |A / A* - 1|, A = max - min.
        frequency_error: |f / f* - 1|, infinite without a rhythm.
        amplitude: half of the first output's range.
        frequency: [Hz]; NaN without a rhythm.
    """

    target: Target
    outputs: Array
    orbit_error: float = np.inf
    amplitude_error: float = np.inf
    frequency_error: float = np.inf
    amplitude: float = np.nan
    frequency: float = np.nan

    @property
    def metrics(self) -> dict[str, float]:
        """Errors, and amplitude and frequency beside the target's."""
        names = ("orbit_error", "amplitude_error", "frequency_error", "amplitude", "frequency")
        return {
            **{name: getattr(self, name) for name in names},
            "target_amplitude": self.target_amplitude,
            "target_frequency": 1.0 / self.target.period,
        }

    @property
    def target_amplitude(self) -> float:
        """Half of the range of the target's first output."""
        return 0.5 * float(np.ptp(self.target.orbit(orbits.ORBIT_POINTS)[:, 0]))


@dataclass(frozen=True)
class BodyResult:
    """One body: `practised` is None if its readout came with the file; `held` is by input."""

    start: Start
    w_out: Array
    practised: Practised | None
    held: dict[float, Held]
    sweep: Sweep | None


@dataclass(frozen=True)
class Outcome:
    """What counts for the rates: orbit errors by input, and how practice went.

    Attributes:
        orbit_errors: infinite if the body blew up under the teacher.
        practice_errors: of the worst jump after teaching and after every round; empty if
            nothing was taught.
    """

    orbit_errors: dict[float, float]
    practice_errors: tuple[float, ...]


@dataclass(frozen=True)
class Result:
    """The first body, which is drawn, and the outcomes of all."""

    config: Config
    first: BodyResult
    outcomes: list[Outcome]

    @property
    def body(self) -> Body:
        """The first body."""
        return self.first.start.body

    @property
    def readouts(self) -> dict[str, Array]:
        """The readout that the first body runs, and others that its file holds, by name."""
        own, others = self.config.readout_name, self.first.start.readouts
        return {own: self.first.w_out, **{name: others[name] for name in others if name != own}}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and rates over all seeds."""
        first = self.first
        fit = first.practised.fit if first.practised else None
        table: dict[str, object] = {
            "eps": {f"{u:g}": run.metrics for u, run in first.held.items()},
            "sweep": self.sweep,
            "taught_inputs": first.start.taught,
            "train_nrmse": fit.train_nrmse if fit else None,
            "condition_number": fit.condition_number if fit else None,
            "practice_errors": self.outcomes[0].practice_errors,
        }
        if self.config.seeds > 1:
            table["rates"] = self.rates
        return table

    @property
    def sweep(self) -> dict[str, object] | None:
        """Hysteresis from the smallest of the inputs jumped to on, and over the whole range."""
        sweep = self.first.sweep
        if sweep is None:
            return None
        return {
            **sweep.differences(min(self.config.inputs)),
            "whole_range": sweep.differences(),
        }

    @property
    def rates(self) -> dict[str, dict[str, object]]:
        """How many bodies run each of the inputs jumped to, and all of them."""
        tolerance = self.config.tolerance
        by_input = {
            u: np.array([one.orbit_errors[u] for one in self.outcomes]) for u in self.config.inputs
        }
        table = {
            f"{u:g}": {
                **success_rate(errors < tolerance),
                "median_orbit_error": float(np.median(errors)),
                "orbit_errors": errors,
            }
            for u, errors in by_input.items()
        }
        practice = [one.practice_errors for one in self.outcomes]
        table["all_inputs"] = {
            **success_rate(np.max(list(by_input.values()), axis=0) < tolerance),
            "without_practice": success_rate([bool(e) and e[0] < tolerance for e in practice]),
            "rounds": [max(0, len(errors) - 1) for errors in practice],
        }
        return table
