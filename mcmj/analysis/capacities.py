"""What a reservoir is worth as a computer: memory and processing capacity, and its ranks.

Symbols, independent and uniform in [-1, 1], drive one input for `hold` seconds each, the feedback
open; the state is the signals at the start of the last step of each. See mcmj.metrics.capacity for
the measures.
"""

from dataclasses import dataclass

import numpy as np

from mcmj.metrics.capacity import (
    Capacities,
    generalisation_rank,
    kernel_rank,
    processing_capacity,
)
from mcmj.simulation.held_symbols import Driven, held_states
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)

MEASURES = ("memory_capacity", "ipc_total", "kernel_rank", "generalisation_rank")


@dataclass(frozen=True)
class Probe:
    """How capacities and ranks are measured.

    Attributes:
        seed: of the symbols.
        symbols: number of symbols.
        washout: symbols left out at the start.
        hold: how long a symbol is shown [s].
        strength: value of the input per unit symbol; of a body, force on top of the input weights.
        channel: the input that is driven, or the output channel whose offset is, by name; default:
            the first input, or the first output channel of a reservoir without inputs.
        max_delays: largest delay of the targets, for degree 1, 2, ...
        streams: input streams of the ranks; above the number of signals.
        stream_symbols: their length; the last `shared` are alike for the generalisation rank.
        shared: number of those.
        resolution: of the readout that the ranks assume, in units of the signals ([m] of lengths).
        relative: every signal is divided by its own standard deviation first, for signals of
            different units; those that do not move are left out.
        threads: results do not depend on them.
    """

    seed: int = 0
    symbols: int = 5000
    washout: int = 100
    hold: float = 0.1
    strength: float = 1.0
    channel: str | None = None
    max_delays: tuple[int, ...] = (60, 20, 8)
    streams: int = 100
    stream_symbols: int = 40
    shared: int = 10
    resolution: float = 1e-4
    relative: bool = False
    threads: int = 1

    def __post_init__(self) -> None:
        for name in ("symbols", "washout", "streams", "stream_symbols", "threads"):
            require_count(name, getattr(self, name), 1)
        for name in ("hold", "strength", "resolution"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_count("shared", self.shared, 0)
        require_duration("hold", self.hold)
        require_seed("seed", self.seed)
        for name in ("symbols", "streams"):
            length = self.stream_symbols if name == "streams" else 1
            require_duration(f"{name} x hold", getattr(self, name) * length * self.hold)
        if self.shared >= self.stream_symbols:
            raise InvalidArgumentError(
                "shared", f"fewer than the {self.stream_symbols} symbols of a stream", self.shared
            )


@dataclass(frozen=True)
class Worth:
    """One reservoir: its capacities and ranks."""

    capacities: Capacities
    kernel_rank: int
    generalisation_rank: int

    @property
    def measures(self) -> dict[str, float]:
        """By the names of MEASURES; the memory capacity starts at delay 1 (Jaeger 2002)."""
        return {
            "memory_capacity": self.capacities.memory,
            "ipc_total": self.capacities.total,
            "kernel_rank": self.kernel_rank,
            "generalisation_rank": self.generalisation_rank,
        }


def capacities_of(reservoir: Reservoir, probe: Probe | None = None) -> Worth:
    """Capacities and ranks of a reservoir, from its start; it is where the symbols left it then.

    Args:
        reservoir: without copies; its readout is of no effect.
        probe: default: Probe().

    Raises:
        DivergenceError: it blew up.
        InvalidArgumentError: a reservoir with copies, or with nothing to drive.
        UnknownNameError: no such channel.
    """
    p = Probe() if probe is None else probe
    if reservoir.copies is not None:
        raise InvalidArgumentError("reservoir", "one without copies", reservoir.copies)
    least = 2 * reservoir.n_signals + max(p.max_delays) + 1
    if p.symbols < least:
        raise InvalidArgumentError(
            "symbols", f"at least {least} for {reservoir.n_signals} signals", p.symbols
        )
    driven, column = driven_channel(reservoir, p.channel)
    width = reservoir.n_inputs if driven == "inputs" else reservoir.n_outputs
    hold = max(1, round(p.hold / reservoir.timestep))

    def shown(to: Reservoir, symbols: Array) -> Array:
        values = np.zeros((*symbols.shape[:-1], width))
        values[..., column] = p.strength * symbols[..., 0]
        return held_states(to, values, hold, driven=driven, gate=0.0)

    u = stream(p.seed, "probe_inputs").uniform(-1.0, 1.0, (p.washout + p.symbols, 1))
    reservoir.reset()
    states = shown(reservoir, u)[p.washout :]
    scale = _spread(states) if p.relative else np.ones(reservoir.n_signals)
    capacities = processing_capacity(states / scale, u[p.washout :, 0], p.max_delays)
    streams = stream(p.seed, "probe_inputs").uniform(-1.0, 1.0, (p.streams, p.stream_symbols, 1))
    alike = streams.copy()
    alike[:, p.stream_symbols - p.shared :] = streams[:1, -p.shared :]
    ends = [
        shown(reservoir.with_copies(p.streams, p.threads), symbols)[:, -1] / scale
        for symbols in (streams, alike)
    ]
    return Worth(
        capacities,
        kernel_rank(ends[0], p.resolution),
        generalisation_rank(ends[1], p.resolution),
    )


def _spread(states: Array) -> Array:
    """Standard deviations (n_signals,) of states (M, n_signals); infinite without motion."""
    spread = states.std(axis=0)
    return np.where(spread > 1e-9 * spread.max(), spread, np.inf)


def driven_channel(reservoir: Reservoir, name: str | None) -> tuple[Driven, int]:
    """What a name stands for, an input or the offset of an output channel, and which of them.

    Raises:
        InvalidArgumentError: the reservoir has neither.
        UnknownNameError: no such channel.
    """
    known: list[tuple[str, Driven, int]] = [
        *((each, "inputs", i) for i, each in enumerate(reservoir.input_names)),
        *((each, "offset", i) for i, each in enumerate(reservoir.channel_names)),
    ]
    if not known:
        raise InvalidArgumentError("reservoir", "one with inputs or output channels", reservoir)
    for each, driven, column in known:
        if name in (None, each):
            return driven, column
    raise UnknownNameError("channel", name, [each for each, _, _ in known])
