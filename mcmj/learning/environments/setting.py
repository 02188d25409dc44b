"""What an agent may do in an environment; no dm_control here."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.core.integrators import DEFAULT_INTEGRATOR, INTEGRATORS
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array, require_duration, require_number, require_timestep

ACTIONS, STARTS = ("inputs", "offsets", "both"), ("rest", "cycle")


@dataclass(frozen=True)
class Setting:
    """What an agent may do, and where an episode starts and ends.

    Attributes:
        actions: inputs (of the body's input channels), offsets (added to the fed-back outputs),
            or both, in this order.
        input_limit, offset_limit: largest size of each.
        start: rest (total rest, time 0) or cycle (on the target, by teacher forcing).
        kick: standard deviation of the free nodes' first velocities, on top [m/s].
        gate: 1: the loop is closed; 0: open, the agent is all that feeds back.
        control_timestep: between actions [s], a multiple of the timestep.
        timestep: of the physics [s].
        integrator: of the physics, as for Simulation.
        time_limit: of an episode [s].
        good: orbit error up to which the reward is 1.
        margin: further from it than this the reward is below 0.1.

    Raises:
        InvalidArgumentError, UnknownNameError: out of bounds, or no such choice.
    """

    actions: str = "both"
    input_limit: float = 1.0
    offset_limit: float = 1.0
    start: str = "rest"
    kick: float = 0.01
    gate: float = 1.0
    control_timestep: float = 0.02
    timestep: float = 1e-3
    integrator: str = DEFAULT_INTEGRATOR
    time_limit: float = 20.0
    good: float = 0.05
    margin: float = 1.0

    def __post_init__(self) -> None:
        choices = {"actions": ACTIONS, "start": STARTS, "integrator": INTEGRATORS}
        for name, valid in choices.items():
            if getattr(self, name) not in valid:
                raise UnknownNameError(name, getattr(self, name), valid)
        require_timestep("timestep", self.timestep)
        require_duration("time_limit", self.time_limit, self.timestep)
        for name in ("input_limit", "offset_limit", "good", "margin"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("kick", self.kick, 0.0)
        require_number("gate", self.gate, 0.0)
        require_number("control_timestep", self.control_timestep, self.timestep)
        steps = self.control_timestep / self.timestep
        if abs(steps - round(steps)) > 1e-8:  # dm_control's tolerance
            raise InvalidArgumentError(
                "control_timestep", f"a multiple of {self.timestep:g} s", self.control_timestep
            )

    @property
    def passive(self) -> bool:
        """Whether the physics needs mcmj's passive force callback."""
        return INTEGRATORS[self.integrator].by_callback

    def limits(self, body: Body) -> Array:
        """Largest size of an action on each channel, inputs first; 0 where there is none."""
        sizes = np.zeros(body.n_inputs + body.n_outputs)
        if self.actions != "offsets":
            sizes[: body.n_inputs] = self.input_limit
        if self.actions != "inputs":
            sizes[body.n_inputs :] = self.offset_limit
        return sizes
