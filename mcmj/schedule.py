"""Experiments as a list of phases, run in the compiled loop and reproducible from a seed.

    Schedule([Phase(10), Phase(10, freeze=(0,)), Phase(30)])

is 10 s undisturbed, 10 s with output 0 held at its last value, 30 s free. In every phase
channel c pushes with g_c (w_c . lengths) + o_c(t), the law of mcmj.drive; a phase says what g
and o are (section 6.1.1 of Hauser et al. 2012 for the perturbations).
"""

from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np
import numpy.typing as npt

from mcmj.alteration import checked_cut, checked_masses
from mcmj.body import Body, spring_lengths
from mcmj.errors import InvalidArgumentError
from mcmj.mjcf import checked_readout
from mcmj.progress import OnSteps
from mcmj.simulation import CHUNK, Simulation
from mcmj.streams import stream
from mcmj.trajectory import Trajectory, join
from mcmj.validation import Array, as_array, require_count, require_number


@dataclass(frozen=True)
class RandomForces:
    """Horizontal forces on all nodes, uniform in [-scale, scale] [N], drawn once a phase."""

    scale: float

    def __post_init__(self) -> None:
        require_number("scale", self.scale, 0.0, open_low=True)


@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of time under the same conditions; only what is given differs from a free run.

    Attributes:
        duration: [s].
        gate: of the feedback channels, a number or (n_outputs,); default 1 with a readout.
        offset: (n_outputs,) constant, added to the fed-back outputs.
        freeze: channels that go on feeding back what they fed back last; in a schedule's first
            phase, the output of that moment. They take no offset.
        forces: (N,) constant horizontal forces on the nodes [N], or RandomForces.
        length_noise: standard deviation of white noise, new every step, on the lengths that
            the readout sees [m].
        w_out: readout to switch to, for this phase and all after it.
        cut: springs that break: without force in this phase and ever after.
        masses: (N,) of the nodes from this phase on [kg].
        name: for figures and tables.
    """

    duration: float
    _: KW_ONLY
    gate: npt.ArrayLike | None = None
    offset: npt.ArrayLike | None = None
    freeze: tuple[int, ...] = ()
    forces: npt.ArrayLike | RandomForces | None = None
    length_noise: float = 0.0
    w_out: npt.ArrayLike | None = None
    cut: tuple[int, ...] = ()
    masses: npt.ArrayLike | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_number("length_noise", self.length_noise, 0.0)
        for name in ("freeze", "cut"):
            numbers = getattr(self, name)
            if not isinstance(numbers, Sequence):
                raise InvalidArgumentError(name, "a tuple of numbers", repr(numbers))
            for number in numbers:
                require_count(name, number, 0)
        for name in ("offset", "masses"):
            if getattr(self, name) is not None:
                as_array(name, getattr(self, name), (None,))
        if self.forces is not None and not isinstance(self.forces, RandomForces):
            as_array("forces", self.forces, (None,))
        if self.w_out is not None:
            as_array("w_out", self.w_out, (None, None))
        if self.gate is not None:
            as_array("gate", np.atleast_1d(np.asarray(self.gate)), (None,))


class Schedule:
    """Phases one after the other.

    Raises:
        InvalidArgumentError: no phase, or something else than phases.
    """

    def __init__(self, phases: Sequence[Phase]) -> None:
        self.phases = tuple(phases)
        if not self.phases or not all(isinstance(phase, Phase) for phase in self.phases):
            raise InvalidArgumentError("phases", "at least one Phase, and only phases", phases)

    def __repr__(self) -> str:
        return f"Schedule({list(self.phases)!r})"

    @property
    def duration(self) -> float:
        """Of all phases together [s]."""
        return sum(phase.duration for phase in self.phases)

    def steps(self, timestep: float) -> list[int]:
        """Numbers of control steps of the phases.

        Raises:
            InvalidArgumentError: a phase shorter than a step.
        """
        counts = [round(phase.duration / timestep) for phase in self.phases]
        if min(counts) < 1:
            raise InvalidArgumentError("duration", f"at least a step of {timestep:g} s", self)
        return counts

    def check(self, body: Body, timestep: float) -> None:
        """Check every phase against a body, before anything runs.

        Raises:
            InvalidArgumentError: a shape, channel or spring that the body does not have.
        """
        self.steps(timestep)
        for phase in self.phases:
            checked_cut(body, phase.cut)
            if phase.masses is not None:
                checked_masses(body, phase.masses)
            if phase.w_out is not None:
                checked_readout(body, phase.w_out)
            if phase.forces is not None and not isinstance(phase.forces, RandomForces):
                as_array("forces", phase.forces, (body.n_nodes,))
            if phase.offset is not None:
                as_array("offset", phase.offset, (body.n_outputs,))
            if np.ndim(0.0 if phase.gate is None else phase.gate):
                as_array("gate", phase.gate, (body.n_outputs,))
            for channel in phase.freeze:
                if channel >= body.n_outputs:
                    raise InvalidArgumentError(
                        "freeze", f"channels 0 to {body.n_outputs - 1}", channel
                    )
                if phase.offset is not None and np.asarray(phase.offset)[channel] != 0.0:
                    raise InvalidArgumentError("offset", f"0 for the frozen channel {channel}",
                                               phase.offset)  # fmt: skip


@dataclass(frozen=True)
class ScheduleRun:
    """What a schedule did.

    Attributes:
        trajectory: of all phases together.
        feedback: (T, n_outputs), g y + o: what the channels really fed back (a feedback delay
            comes on top); a frozen output is constant here, a noisy one noisy.
        boundaries: (phases + 1,) indices: phase i is boundaries[i] .. boundaries[i + 1] - 1.
    """

    trajectory: Trajectory
    feedback: Array
    boundaries: tuple[int, ...]

    def phase(self, index: int) -> slice:
        """Rows of a phase; counts from the end if negative."""
        n = len(self.boundaries) - 1
        first = range(n)[index]
        return slice(self.boundaries[first], self.boundaries[first + 1])


def run_schedule(
    simulation: Simulation,
    schedule: Schedule,
    seed: int,
    *,
    record: Sequence[str] = ("outputs",),
    on_steps: OnSteps = lambda steps: None,
) -> ScheduleRun:
    """Run a schedule from the simulation's state on; the same seed gives the same bits.

    Readouts, cut springs and masses stay as the last phase left them.

    Args:
        seed: of random forces and noise.
        record: as for Simulation.rollout; outputs always are.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up.
        InvalidArgumentError: a phase that does not fit the body.
    """
    if simulation.state.positions.ndim != 2:
        raise InvalidArgumentError("simulation", "a Simulation", type(simulation).__name__)
    schedule.check(simulation.body, simulation.timestep)
    if any(phase.cut or phase.masses is not None for phase in schedule.phases):
        _ = simulation.model  # only MuJoCo's bodies can change: said before anything runs
    forces, noise = stream(seed, "schedule_forces"), stream(seed, "schedule_noise")
    counts = schedule.steps(simulation.timestep)
    parts: list[Trajectory] = []
    feedback: list[Array] = []
    for phase, steps in zip(schedule.phases, counts, strict=True):
        last = feedback[-1][-1] if feedback else None
        for part, pushed in _run_phase(simulation, phase, steps, last, forces, noise, record):
            parts.append(part)
            feedback.append(pushed)
            on_steps(len(part))
    boundaries = tuple(int(n) for n in np.cumsum([0, *counts]))
    return ScheduleRun(join(parts), np.concatenate(feedback), boundaries)


def _run_phase(
    simulation: Simulation,
    phase: Phase,
    steps: int,
    last: Array | None,
    forces_of: np.random.Generator,
    noise_of: np.random.Generator,
    record: Sequence[str],
) -> Iterator[tuple[Trajectory, Array]]:
    """Chunks of a phase, and what was fed back during each."""
    body = simulation.body
    if phase.w_out is not None:
        simulation.set_readout(phase.w_out)
    if phase.cut or phase.masses is not None:
        simulation.alter(cut=phase.cut, masses=phase.masses)
    forces = phase.forces
    if isinstance(forces, RandomForces):
        forces = forces_of.uniform(-forces.scale, forces.scale, body.n_nodes)
    gate, constant = _gate_and_offset(simulation, phase, last)
    w_out = simulation.w_out
    for start in range(0, steps, CHUNK):
        n = min(CHUNK, steps - start)
        offset = np.tile(constant, (n, 1))
        if phase.length_noise > 0 and w_out is not None:
            noise = phase.length_noise * noise_of.standard_normal((n, body.n_springs))
            # not matmul: its last bits depend on the number of rows
            offset += gate * np.einsum("tl,lc->tc", noise, w_out[: body.n_springs])
        part = simulation.rollout(
            offset=offset, gate=gate, forces=forces, record=tuple({*record, "outputs"})
        )
        yield part, gate * part.get("outputs") + offset


def _gate_and_offset(
    simulation: Simulation, phase: Phase, last: Array | None
) -> tuple[Array, Array]:
    """Gate and constant offset (n_outputs,) of a phase; frozen channels hold what was `last`."""
    body, w_out = simulation.body, simulation.w_out
    gate = np.full(body.n_outputs, float(w_out is not None))
    if phase.gate is not None:
        gate[:] = phase.gate
    offset = np.zeros(body.n_outputs)
    if phase.offset is not None:
        offset[:] = phase.offset
    if phase.freeze:
        frozen = list(phase.freeze)
        held = _outputs_now(simulation) if last is None else last
        gate[frozen], offset[frozen] = 0.0, held[frozen]
    return gate, offset


def _outputs_now(simulation: Simulation) -> Array:
    body, w_out = simulation.body, simulation.w_out
    if w_out is None:
        return np.zeros(body.n_outputs)
    lengths = spring_lengths(simulation.state.positions, body.springs)
    return lengths @ w_out[: body.n_springs] + w_out[body.n_springs :].sum(axis=0)
