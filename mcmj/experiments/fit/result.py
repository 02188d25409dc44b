"""What a readout makes of a recording, and what the recording is worth."""

from dataclasses import dataclass

import numpy as np

from mcmj.experiments.fit.config import Config
from mcmj.learning.regression import Fit
from mcmj.metrics.capacity import Capacities
from mcmj.metrics.orbits import nrmse_std
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Worth:
    """What the inputs tell.

    Attributes:
        capacities: of the signals, for targets of the inputs' history.
        baseline: held-out nrmse_std of the same regression on the inputs and their delays.
        autocorrelation: of the inputs, the largest in size of the delays looked at; near 0 for
            independent ones.
    """

    capacities: Capacities
    baseline: float
    autocorrelation: float


@dataclass(frozen=True)
class Result:
    """One fit.

    Attributes:
        signal_names, target_names: of the columns.
        fit: on the rows before the held-out ones.
        times: (M,) of the held-out rows [s], or row numbers if the files have no time.
        has_time: they have.
        outputs, wanted: (M, n_targets), held out.
        spectrum: (n_signals,) standard deviations of the training signals along their principal
            directions, the largest first, in units of the signals.
        rank: how many of them are above rounding.
        worth: with inputs.
    """

    config: Config
    signal_names: tuple[str, ...]
    target_names: tuple[str, ...]
    fit: Fit
    times: Array
    has_time: bool
    outputs: Array
    wanted: Array
    spectrum: Array
    rank: int
    worth: Worth | None

    @property
    def errors(self) -> dict[str, float]:
        """Held-out sqrt(mean (y - y*)^2) / std(y*) of each target; 1 is as good as its mean."""
        return {
            name: nrmse_std(self.outputs[:, [i]], self.wanted[:, [i]])
            for i, name in enumerate(self.target_names)
        }

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        found: dict[str, object] = {
            "test_nrmse_std": nrmse_std(self.outputs, self.wanted),
            "test_nrmse_std_by_target": self.errors,
            "train_nrmse_std": self.fit.train_nrmse,
            "train_rows": self.fit.rows,
            "test_rows": len(self.wanted),
            "n_signals": len(self.signal_names),
            "rank": self.rank,
            "condition_number": self.fit.condition_number,
            "singular_values": self.spectrum,
        }
        if self.config.resolution is not None:
            above = self.spectrum > self.config.resolution
            found["rank_above_resolution"] = int(np.count_nonzero(above))
        return found | (_told(self.worth, self.config) if self.worth else {})


def _told(worth: Worth, config: Config) -> dict[str, object]:
    capacities = worth.capacities
    degrees = range(1, len(config.max_delays) + 1)
    return {
        "baseline_test_nrmse_std": worth.baseline,
        "memory_capacity": capacities.memory,
        "memory_by_delay": capacities.by_delay(1),
        "information_processing_capacity": capacities.total,
        "ipc_by_degree": {str(degree): capacities.of_degree(degree) for degree in degrees},
        "ipc_bound": capacities.rank,
        "ipc_threshold": capacities.threshold,
        "input_autocorrelation": worth.autocorrelation,
    }
