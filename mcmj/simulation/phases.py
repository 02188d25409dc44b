"""What an experiment's phases say; mcmj.simulation.run_phases runs them.

    Schedule([Phase(10), Phase(10, freeze=(0,)), Phase(30)])

is 10 s undisturbed, 10 s with output 0 held at its last value, 30 s free. In every phase
channel c pushes with g_c (w_c . lengths) + o_c(t), the law of a rollout; a phase says what g
and o are (section 6.1.1 of Hauser et al. 2012 for the perturbations).
"""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np
import numpy.typing as npt

from mcmj.core.readout import Readout
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    as_array,
    require_count,
    require_duration,
    require_name,
    require_number,
)


@dataclass(frozen=True)
class RandomForces:
    """Forces uniform in [-scale, scale], drawn once a phase.

    On all nodes of a body, along its direction [N]; on all degrees of freedom of a model.
    """

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
        freeze: channels, by number or name, that go on feeding back what they fed back last; in
            a schedule's first phase, the output of that moment. They take no offset.
        forces: constant, as for a rollout: (n_forces,), or {body: (3,)} of a model; or
            RandomForces.
        length_noise: standard deviation of white noise, new every step, on the signals that
            the readout hears; lengths of a body [m].
        w_out: readout to switch to, for this phase and all after it.
        cut: springs that break, by number, or tendons of a model by name: without force in this
            phase and ever after.
        masses: (N,) of the nodes, or {body: mass} of a model, from this phase on [kg].
        name: for figures and tables.
    """

    duration: float
    _: KW_ONLY
    gate: npt.ArrayLike | None = None
    offset: npt.ArrayLike | None = None
    freeze: tuple[int | str, ...] = ()
    forces: npt.ArrayLike | Mapping[str, npt.ArrayLike] | RandomForces | None = None
    length_noise: float = 0.0
    w_out: npt.ArrayLike | Readout | None = None
    cut: tuple[int, ...] | tuple[str, ...] = ()
    masses: npt.ArrayLike | Mapping[str, float] | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_duration("duration", self.duration)
        require_number("length_noise", self.length_noise, 0.0)
        for name in ("freeze", "cut"):
            items = getattr(self, name)
            if not isinstance(items, Sequence) or isinstance(items, str):
                raise InvalidArgumentError(name, "a tuple of numbers or names", repr(items))
            for item in items:
                if not isinstance(item, str):
                    require_count(name, item, 0)
        for name in ("offset", "masses", "forces"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, Mapping | RandomForces):
                as_array(name, value, (None,))
        if self.w_out is not None and not isinstance(self.w_out, Readout):
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

    def check(self, reservoir: Reservoir) -> None:
        """Check every phase against a body or model, before anything runs.

        Raises:
            InvalidArgumentError, UnknownNameError: a shape, channel, spring or name that it does
                not have.
        """
        self.steps(reservoir.timestep)
        n_outputs, n_forces = reservoir.n_outputs, reservoir.n_forces
        for phase in self.phases:
            reservoir.check_alteration(phase.cut, phase.masses)
            if phase.w_out is not None:
                reservoir.checked_readout(phase.w_out)
            if phase.forces is not None and not isinstance(phase.forces, Mapping | RandomForces):
                as_array("forces", phase.forces, (n_forces,))
            if phase.offset is not None:
                as_array("offset", phase.offset, (n_outputs,))
            if np.ndim(0.0 if phase.gate is None else phase.gate):
                as_array("gate", phase.gate, (n_outputs,))
            for channel in frozen_channels(reservoir, phase):
                if phase.offset is not None and np.asarray(phase.offset)[channel] != 0.0:
                    raise InvalidArgumentError("offset", f"0 for the frozen channel {channel}",
                                               phase.offset)  # fmt: skip


def frozen_channels(reservoir: Reservoir, phase: Phase) -> list[int]:
    """Numbers of the channels that a phase freezes.

    Raises:
        InvalidArgumentError, UnknownNameError: one that the reservoir does not have.
    """
    found, names = [], reservoir.channel_names
    for channel in phase.freeze:
        if isinstance(channel, str):
            require_name("channel", names, channel)
            found.append(names.index(channel))
        elif channel >= len(names):
            raise InvalidArgumentError("freeze", f"channels 0 to {len(names) - 1}", channel)
        else:
            found.append(channel)
    return found
