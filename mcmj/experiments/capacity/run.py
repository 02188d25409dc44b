"""What a body is worth: memory and processing capacity, kernel and generalisation rank.

Symbols, independent and uniform in [-1, 1], push the body for `hold` seconds each; its state is
its lengths at the end of each. One body in MuJoCo; then maps over stiffness and damping, and
over size and input strength, by the compiled twin (same bits but for rounding, faster).
"""

from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import MOST_NODES, BodySettings, draw_body
from mcmj.metrics.capacity import Capacities, generalisation_rank, kernel_rank, processing_capacity
from mcmj.simulation.ensemble import Ensemble
from mcmj.simulation.held_symbols import held_states
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)

TIMESTEP = 1e-3  # s
MEASURES = ("memory_capacity", "ipc_total", "kernel_rank", "generalisation_rank")


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


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Measure one body in MuJoCo, then the maps' bodies."""
    body = draw_body(config.seed, config.settings)
    worth = measure(config, body, config.strength, config.symbols, engine="mujoco")
    on_steps(1)
    maps: dict[str, dict[str, Array]] = {}
    if config.maps:
        for name, table in (("stiffness_damping", _scaled), ("size_strength", _sized)):
            maps[name] = _map(config, *table(config), on_steps)
    return Result(config, worth, body.n_springs, maps)


def total_bodies(config: Config) -> int:
    """Bodies to measure, for a progress bar."""
    cells = len(config.stiffness) * len(config.damping) + len(config.sizes) * len(config.strengths)
    return 1 + cells * config.maps


def measure(config: Config, body: Body, strength: float, symbols: int, *, engine: str) -> Worth:
    """Capacities and ranks of a body.

    Raises:
        DivergenceError: the body blew up.
    """
    u = stream(config.seed, "probe_inputs").uniform(-1.0, 1.0, (config.washout + symbols, 1))
    options: dict[str, Any] = {
        "timestep": TIMESTEP,
        "integrator": config.integrator,
        "engine": engine,
    }
    sim = Simulation(body, **options)
    states = held_states(sim, strength * u, config.hold_steps)[config.washout :]
    capacities = processing_capacity(states, u[config.washout :, 0], config.max_delays)
    streams = stream(config.seed, "probe_inputs").uniform(
        -1.0, 1.0, (config.streams, config.stream_symbols, 1)
    )
    alike = streams.copy()
    alike[:, config.stream_symbols - config.shared :] = streams[:1, -config.shared :]
    ends = []
    for shown in (streams, alike):
        copies = Ensemble(body, copies=config.streams, threads=config.threads, **options)
        ends.append(held_states(copies, strength * shown, config.hold_steps)[:, -1])
    return Worth(
        capacities,
        kernel_rank(ends[0], config.resolution),
        generalisation_rank(ends[1], config.resolution),
    )


def _scaled(config: Config) -> tuple[tuple[int, int], list[tuple[BodySettings, float]]]:
    """Shape, settings and strengths of the bodies of the first map."""
    s = config.settings
    cells = []
    for stiff, damp in product(config.stiffness, config.damping):
        ranges: dict[str, Any] = {
            name: tuple(factor * bound for bound in getattr(s, name))
            for name, factor in (("k1", stiff), ("k3", stiff), ("d1", damp), ("d3", damp))
        }
        cells.append((replace(s, **ranges), config.strength))
    return (len(config.stiffness), len(config.damping)), cells


def _sized(config: Config) -> tuple[tuple[int, int], list[tuple[BodySettings, float]]]:
    """The same of the second map; the density of the nodes stays."""
    s = config.settings
    cells = []
    for nodes, strength in product(config.sizes, config.strengths):
        scale = float(np.sqrt(nodes / s.nodes))
        sized = replace(s, nodes=nodes, width=scale * s.width, height=scale * s.height)
        cells.append((sized, strength))
    return (len(config.sizes), len(config.strengths)), cells


def _map(
    config: Config,
    shape: tuple[int, int],
    cells: list[tuple[BodySettings, float]],
    on_steps: OnSteps,
) -> dict[str, Array]:
    rows = []
    for settings, strength in cells:
        body = draw_body(config.seed, settings)
        try:
            worth = measure(config, body, strength, config.map_symbols, engine="twin")
            rows.append(worth.measures)
        except DivergenceError:
            rows.append(dict.fromkeys(MEASURES, np.nan))
        on_steps(1)
    return {
        m: np.array([row[m] for row in rows], dtype=np.float64).reshape(shape) for m in MEASURES
    }
