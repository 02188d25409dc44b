"""What an agent may do in an environment of mcmj.environment; no dm_control here."""

from dataclasses import dataclass

from mcmj.errors import UnknownNameError
from mcmj.validation import require_number

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
        time_limit: of an episode [s].
        good: orbit error up to which the reward is 1.
        margin: further from it than this the reward is below 0.1.
    """

    actions: str = "both"
    input_limit: float = 1.0
    offset_limit: float = 1.0
    start: str = "rest"
    kick: float = 0.01
    gate: float = 1.0
    control_timestep: float = 0.02
    timestep: float = 1e-3
    time_limit: float = 20.0
    good: float = 0.05
    margin: float = 1.0

    def __post_init__(self) -> None:
        if self.actions not in ACTIONS:
            raise UnknownNameError("actions", self.actions, ACTIONS)
        if self.start not in STARTS:
            raise UnknownNameError("start", self.start, STARTS)
        for name in ("input_limit", "offset_limit", "timestep", "time_limit", "good", "margin"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("kick", self.kick, 0.0)
        require_number("gate", self.gate, 0.0)
        require_number("control_timestep", self.control_timestep, self.timestep)
