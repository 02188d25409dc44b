"""What a body is worth, and maps over settings."""

from dataclasses import dataclass

from mcmj.experiments.capacity.config import Config
from mcmj.metrics.capacity import Capacities
from mcmj.utils.validation import Array

MEASURES = ("memory_capacity", "ipc_total", "kernel_rank", "generalisation_rank")


@dataclass(frozen=True)
class Worth:
    """One body: its capacities and ranks."""

    capacities: Capacities
    kernel_rank: int
    generalisation_rank: int

    @property
    def measures(self) -> dict[str, float]:
        """By the names of MEASURES; the memory capacity starts at delay 1 (Jaeger 2002)."""
        linear = self.capacities.of_degree(1)
        return {
            "memory_capacity": linear - self.capacities.of(((0, 1),)),
            "ipc_total": self.capacities.total,
            "kernel_rank": self.kernel_rank,
            "generalisation_rank": self.generalisation_rank,
        }


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes:
        worth: of the body in MuJoCo.
        n_springs: of it.
        maps: [map][measure] arrays over (stiffness, damping), and over (sizes, strengths); NaN
            where a body blew up.
    """

    config: Config
    worth: Worth
    n_springs: int
    maps: dict[str, dict[str, Array]]

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
            "n_springs": self.n_springs,
            "maps": self.maps,
        }
