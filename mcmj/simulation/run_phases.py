"""Phases run one after the other in the compiled loop, reproducible from a seed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mcmj.core.trajectory import Trajectory, join
from mcmj.simulation.phases import Phase, RandomForces, Schedule, frozen_channels
from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_name


@dataclass(frozen=True)
class ScheduleRun:
    """What a schedule did.

    Attributes:
        trajectory: of all phases together.
        feedback: (T, n_outputs), g y + o: what the channels really fed back (a feedback delay
            comes on top); a frozen output is constant here, a noisy one noisy.
        boundaries: (phases + 1,) indices: phase i is boundaries[i] .. boundaries[i + 1] - 1.
        names: of the phases.
    """

    trajectory: Trajectory
    feedback: Array
    boundaries: tuple[int, ...]
    names: tuple[str, ...] = ()

    def phase(self, which: int | str) -> slice:
        """Rows of a phase, by its name or number; counts from the end if negative.

        Raises:
            InvalidArgumentError, UnknownNameError: no such phase.
        """
        n = len(self.boundaries) - 1
        if isinstance(which, str):
            require_name("phase", self.names, which)
            which = self.names.index(which)
        if not -n <= which < n:
            raise InvalidArgumentError("phase", f"a name, or a number from 0 to {n - 1}", which)
        first = range(n)[which]
        return slice(self.boundaries[first], self.boundaries[first + 1])


def run_schedule(
    simulation: Reservoir,
    schedule: Schedule | Sequence[Phase],
    seed: int,
    *,
    record: Sequence[str] = ("outputs",),
    on_steps: OnSteps = lambda steps: None,
) -> ScheduleRun:
    """Run a schedule from the simulation's state on; the same seed gives the same bits.

    Readouts, cut springs and masses stay as the last phase left them.

    Args:
        schedule: a Schedule, or its phases.
        seed: of random forces and noise.
        record: as for a rollout; outputs always are.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up.
        InvalidArgumentError: a phase that does not fit the body.
    """
    if simulation.copies is not None:
        raise InvalidArgumentError("simulation", "one without copies", f"{simulation.copies}")
    schedule = schedule if isinstance(schedule, Schedule) else Schedule(schedule)
    schedule.check(simulation)
    forces, noise = stream(seed, "schedule_forces"), stream(seed, "schedule_noise")
    counts = schedule.steps(simulation.timestep)
    parts: list[Trajectory] = []
    feedback: list[Array] = []
    for phase, steps in zip(schedule.phases, counts, strict=True):
        last = feedback[-1][-1] if feedback else None
        if isinstance(phase.forces, RandomForces):
            scale = phase.forces.scale
            pattern = forces.uniform(-scale, scale, simulation.n_forces)
            phase = replace(phase, forces=pattern)
        for part, pushed in _run_phase(simulation, phase, steps, last, noise, record):
            parts.append(part)
            feedback.append(pushed)
            on_steps(len(part))
    boundaries = tuple(int(n) for n in np.cumsum([0, *counts]))
    names = tuple(phase.name for phase in schedule.phases)
    return ScheduleRun(join(parts), np.concatenate(feedback), boundaries, names)


def _run_phase(
    simulation: Reservoir,
    phase: Phase,
    steps: int,
    last: Array | None,
    noise_of: np.random.Generator,
    record: Sequence[str],
) -> Iterator[tuple[Trajectory, Array]]:
    """Chunks of a phase, and what was fed back during each."""
    if phase.w_out is not None:
        simulation.set_readout(phase.w_out)
    if phase.cut or phase.masses is not None:
        simulation.alter(cut=phase.cut, masses=phase.masses)
    gate, constant = _gate_and_offset(simulation, phase, last)
    for start in range(0, steps, CHUNK):
        n = min(CHUNK, steps - start)
        offset = np.tile(constant, (n, 1))
        if phase.length_noise > 0 and simulation.w_out is not None:
            noise = phase.length_noise * noise_of.standard_normal((n, simulation.n_signals))
            offset += gate * simulation.readout.weighted(noise)
        part = simulation.rollout(
            offset=offset, gate=gate, forces=phase.forces, record=tuple({*record, "outputs"})
        )
        yield part, gate * part.get("outputs") + offset


def _gate_and_offset(
    simulation: Reservoir, phase: Phase, last: Array | None
) -> tuple[Array, Array]:
    """Gate and constant offset (n_outputs,) of a phase; frozen channels hold what was `last`."""
    n_outputs = simulation.n_outputs
    gate = np.full(n_outputs, float(simulation.w_out is not None))
    if phase.gate is not None:
        gate[:] = phase.gate
    offset = np.zeros(n_outputs)
    if phase.offset is not None:
        offset[:] = phase.offset
    if phase.freeze:
        frozen = frozen_channels(simulation, phase)
        held = simulation.readout.outputs(simulation.signals) if last is None else last
        gate[frozen], offset[frozen] = 0.0, held[frozen]
    return gate, offset
