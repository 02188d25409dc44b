"""What the capacity experiment measures: its Config."""

from dataclasses import dataclass, field

from mcmj.analysis.capacities import Probe
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import MOST_NODES, BodySettings
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_duration, require_number

TIMESTEP = 1e-3  # s


def probed_body() -> BodySettings:
    """Of the toolbox's NARMA script: stiffer and smaller than the rhythms' bodies."""
    return BodySettings(
        width=10.0, height=10.0, k1=(10.0, 100.0), k3=(10.0, 100.0), d1=(1.0, 10.0),
        d3=(1.0, 100.0), n_inputs=1, n_outputs=0,
    )  # fmt: skip


@dataclass(frozen=True)
class Config(Probe):
    """What to measure.

    Attributes:
        reservoir: file of a reservoir (Reservoir.to_mjcf), any MuJoCo model with its sensors and
            channels; default: a random body.
        maps: whether to make the maps, of random bodies; there are none of a reservoir's file.
        map_symbols: symbols of each of the maps' bodies.
        stiffness, damping: factors on k1 and k3, on d1 and d3, of the first map.
        sizes, strengths: nodes, and strengths, of the second map.
        integrator: as for Simulation; a reservoir has its own.
        settings: what the body is drawn from, with the same seed.
    """

    reservoir: str | None = None
    maps: bool = True
    map_symbols: int = 2000
    stiffness: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
    damping: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)
    sizes: tuple[int, ...] = (5, 10, 15, 20, 30)
    strengths: tuple[float, ...] = (0.1, 1.0, 5.0, 20.0, 100.0)
    integrator: str = DEFAULT_INTEGRATOR
    settings: BodySettings = field(default_factory=probed_body)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_count("map_symbols", self.map_symbols, 1)
        require_duration("map_symbols x hold", self.map_symbols * self.hold)
        for name in ("stiffness", "damping", "strengths"):
            for value in getattr(self, name):
                require_number(name, value, 0.0, open_low=True)
        for n in self.sizes:
            require_count("sizes", n, 3, MOST_NODES)
        if self.reservoir is not None:
            usual = {"integrator": DEFAULT_INTEGRATOR, "settings": probed_body()}
            for name, value in usual.items():
                if getattr(self, name) != value:
                    raise InvalidArgumentError(name, "none beside a reservoir", self.reservoir)


def total_bodies(config: Config) -> int:
    """Bodies to measure, for a progress bar."""
    if config.reservoir is not None:
        return 1
    cells = len(config.stiffness) * len(config.damping) + len(config.sizes) * len(config.strengths)
    return 1 + cells * config.maps
