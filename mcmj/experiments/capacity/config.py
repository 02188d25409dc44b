"""What the capacity experiment measures: its Config."""

from dataclasses import dataclass, field

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import MOST_NODES, BodySettings
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_duration, require_number, require_seed

TIMESTEP = 1e-3  # s


def probed_body() -> BodySettings:
    """Of the toolbox's NARMA script: stiffer and smaller than the rhythms' bodies."""
    return BodySettings(
        width=10.0, height=10.0, k1=(10.0, 100.0), k3=(10.0, 100.0), d1=(1.0, 10.0),
        d3=(1.0, 100.0), n_inputs=1, n_outputs=0,
    )  # fmt: skip


@dataclass(frozen=True)
class Config:
    """What to measure.

    Attributes:
        seed: of the body and the symbols.
        symbols: of the one body in MuJoCo.
        washout: symbols left out at the start.
        hold: how long a symbol is shown [s].
        strength: force per unit symbol on top of the input weights, as are the maps'.
        max_delays: largest delay of the targets, for degree 1, 2, ...
        streams: input streams of the ranks; above the number of springs.
        stream_symbols: their length; the last `shared` are alike for the generalisation rank.
        shared: number of those.
        resolution: of the readout that the ranks assume [m].
        maps: whether to make the maps.
        map_symbols: symbols of each of the maps' bodies.
        stiffness, damping: factors on k1 and k3, on d1 and d3, of the first map.
        sizes, strengths: nodes, and strengths, of the second map.
        integrator: as for Simulation.
        threads: results do not depend on them.
        settings: what the body is drawn from.
    """

    seed: int = 0
    symbols: int = 5000
    washout: int = 100
    hold: float = 0.1
    strength: float = 1.0
    max_delays: tuple[int, ...] = (60, 20, 8)
    streams: int = 100
    stream_symbols: int = 40
    shared: int = 10
    resolution: float = 1e-4
    maps: bool = True
    map_symbols: int = 2000
    stiffness: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
    damping: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)
    sizes: tuple[int, ...] = (5, 10, 15, 20, 30)
    strengths: tuple[float, ...] = (0.1, 1.0, 5.0, 20.0, 100.0)
    integrator: str = DEFAULT_INTEGRATOR
    threads: int = 1
    settings: BodySettings = field(default_factory=probed_body)

    def __post_init__(self) -> None:
        for name in ("symbols", "washout", "streams", "stream_symbols", "map_symbols", "threads"):
            require_count(name, getattr(self, name), 1)
        for name in ("hold", "strength", "resolution"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_count("shared", self.shared, 0)
        require_duration("hold", self.hold)
        require_seed("seed", self.seed)
        for name in ("symbols", "map_symbols", "streams"):
            length = self.stream_symbols if name == "streams" else 1
            require_duration(f"{name} x hold", getattr(self, name) * length * self.hold)
        if self.shared >= self.stream_symbols:
            raise InvalidArgumentError(
                "shared", f"fewer than the {self.stream_symbols} symbols of a stream", self.shared
            )
        for name in ("stiffness", "damping", "strengths"):
            for value in getattr(self, name):
                require_number(name, value, 0.0, open_low=True)
        for n in self.sizes:
            require_count("sizes", n, 3, MOST_NODES)

    @property
    def hold_steps(self) -> int:
        """Control steps a symbol."""
        return max(1, round(self.hold / TIMESTEP))


def total_bodies(config: Config) -> int:
    """Bodies to measure, for a progress bar."""
    cells = len(config.stiffness) * len(config.damping) + len(config.sizes) * len(config.strengths)
    return 1 + cells * config.maps
