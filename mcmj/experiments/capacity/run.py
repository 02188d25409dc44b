"""What a body is worth: memory and processing capacity, kernel and generalisation rank.

Symbols, independent and uniform in [-1, 1], push the body for `hold` seconds each; its state is
its lengths at the end of each (`mcmj.analysis.capacities`, which takes any reservoir). One body in
MuJoCo; then maps over stiffness and damping, and over size and input strength, by the compiled
twin (same bits but for rounding, faster).
"""

from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from mcmj.analysis.capacities import MEASURES, Worth, capacities_of
from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings, draw_body
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.capacity.config import TIMESTEP, Config
from mcmj.experiments.capacity.result import Result
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Measure one body in MuJoCo, then the maps' bodies; or a reservoir's file.

    Raises:
        BodyFileError: no such file, or not that of a reservoir.
        DivergenceError: the body or the reservoir blew up.
    """
    if config.reservoir is not None:
        model = Reservoir.open(config.reservoir)
        worth = capacities_of(model, config)
        on_steps(1)
        return Result(config, worth, model.n_signals, {})
    body = draw_body(config.seed, config.settings)
    worth = measure(config, body, config.strength, config.symbols, engine="mujoco")
    on_steps(1)
    maps: dict[str, dict[str, Array]] = {}
    if config.maps:
        for name, table in (("stiffness_damping", _scaled), ("size_strength", _sized)):
            maps[name] = _map(config, *table(config), on_steps)
    return Result(config, worth, body.n_springs, maps)


def measure(config: Config, body: Body, strength: float, symbols: int, *, engine: str) -> Worth:
    """Capacities and ranks of a body.

    Raises:
        DivergenceError: the body blew up.
    """
    sim = Simulation(body, timestep=TIMESTEP, integrator=config.integrator, engine=engine)
    return capacities_of(sim, replace(config, strength=strength, symbols=symbols))


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
        work = partial(measure, config, body, strength, config.map_symbols, engine="twin")
        worth = or_lost(work, None)
        rows.append(dict.fromkeys(MEASURES, np.nan) if worth is None else worth.measures)
        on_steps(1)
    return {
        m: np.array([row[m] for row in rows], dtype=np.float64).reshape(shape) for m in MEASURES
    }
