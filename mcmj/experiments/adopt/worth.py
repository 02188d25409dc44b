"""What a model is worth as a reservoir: memory, capacity, rank, by what random symbols leave in it.

A symbol, uniform in [-1, 1], takes the place of the first output at the size that it has at work,
for a tenth of the target's period; the state is the signals at the end of it.
"""

from collections.abc import Iterator

import numpy as np

from mcmj.core.trajectory import Trajectory
from mcmj.experiments.adopt.config import Config
from mcmj.experiments.adopt.result import Worth
from mcmj.metrics.capacity import kernel_rank, processing_capacity
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

HOLDS_PER_PERIOD = 10
WASHOUT = 50  # symbols
MAX_DELAYS = (30, 8, 4)  # symbols, of degree 1, 2, 3
STREAM_SYMBOLS = 10
RESOLUTION = 0.01  # of a signal's standard deviation


def measure_worth(config: Config, reservoir: Reservoir, target: Target) -> Worth:
    """Capacities and ranks; the reservoir is afterwards where the last symbol left it.

    Raises:
        DivergenceError: the model blew up.
    """
    draw = stream(config.seed, "probe_inputs")
    u = draw.uniform(-1.0, 1.0, WASHOUT + config.symbols)
    reservoir.reset()
    states = _states(reservoir, target, u)[WASHOUT:]
    spread = states.std(axis=0)
    moving = spread > 1e-9 * spread.max()
    states = states[:, moving] / spread[moving]
    found = processing_capacity(states, u[WASHOUT:], MAX_DELAYS)
    ends = _ends(reservoir, target, draw.uniform(-1.0, 1.0, (config.streams, STREAM_SYMBOLS)))
    return Worth(
        memory=found.of_degree(1),
        nonlinear=found.of_degree(2) + found.of_degree(3),
        rank=found.rank,
        kernel_rank=kernel_rank(ends[:, moving] / spread[moving], RESOLUTION),
    )


def _states(reservoir: Reservoir, target: Target, symbols: Array) -> Array:
    """Signals (M, n_signals) at the end of each symbol (M,)."""
    hold = max(1, round(target.period / HOLDS_PER_PERIOD / reservoir.timestep))
    size = np.abs(target.orbit(512)[:, 0]).max()
    offset = np.zeros((len(symbols) * hold, target.n_outputs))
    offset[:, 0] = np.repeat(size * symbols, hold)
    parts = reservoir.stream(offset=offset, gate=0.0, record=("signals",))
    return np.concatenate(list(_ends_of_symbols(parts, hold)))


def _ends_of_symbols(parts: Iterator[Trajectory], hold: int) -> Iterator[Array]:
    """The rows of signals at the last step of each symbol, chunk by chunk."""
    done = 0
    for part in parts:
        signals = part.get("lengths")
        first = (hold - 1 - done) % hold
        yield signals[first::hold].copy()
        done += len(signals)


def _ends(reservoir: Reservoir, target: Target, streams: Array) -> Array:
    """Signals (S, n_signals) after each stream of symbols (S, M), from the model's start."""
    ends = []
    for symbols in streams:
        reservoir.reset()
        ends.append(_states(reservoir, target, symbols)[-1])
    return np.array(ends)
