"""What a body or a reservoir is worth, and maps over settings."""

from dataclasses import dataclass

from mcmj.analysis.capacities import Worth
from mcmj.experiments.capacity.config import Config
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes:
        worth: of the body or the reservoir in MuJoCo.
        n_signals: of it: springs of a body.
        maps: [map][measure] arrays over (stiffness, damping), and over (sizes, strengths); NaN
            where a body blew up.
    """

    config: Config
    worth: Worth
    n_signals: int
    maps: dict[str, dict[str, Array]]

    @property
    def signals(self) -> str:
        """What n_signals counts, by its name in metrics.json."""
        return "n_springs" if self.config.reservoir is None else "n_signals"

    @property
    def by_delay(self) -> dict[int, Array]:
        """[degree] capacities of the body by the delay of the oldest input."""
        degrees = range(1, len(self.config.max_delays) + 1)
        return {d: self.worth.capacities.by_delay(d) for d in degrees}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        found = self.worth.capacities
        return {
            **self.worth.measures,
            "ipc_by_degree": {str(d): float(c.sum()) for d, c in self.by_delay.items()},
            "memory_by_delay": self.by_delay[1],
            "ipc_bound": found.rank,
            "ipc_threshold": found.threshold,
            self.signals: self.n_signals,
            "maps": self.maps,
        }
