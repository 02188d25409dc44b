"""What an agent may do in an environment; no dm_control here."""

from dataclasses import dataclass

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_duration, require_number

ACTIONS, STARTS = ("inputs", "offsets", "both"), ("rest", "cycle")


@dataclass(frozen=True)
class Setting:
    """What an agent may do, and where an episode starts and ends.

    Attributes:
        actions: inputs (of the input channels), offsets (added to the fed-back outputs),
            or both, in this order.
        input_limit: largest input.
        offset_limit: largest offset, in units of the target's largest value.
        start: cycle (somewhere on the target, by teacher forcing, at random) or rest (the
            model's start, time 0).
        kick: standard deviation of the joints' first velocities, on top, MuJoCo's units; of a
            body's nodes [m/s].
        gate: 0: the loop is open, and the agent is all that feeds back; 1: the readout's loop is
            closed, and the agent acts beside it.
        control_timestep: between actions [s], a multiple of the physics' step.
        time_limit: of an episode [s].
        margin: motion error at which the reward is 0.1.

    Raises:
        InvalidArgumentError, UnknownNameError: out of bounds, or no such choice.
    """

    actions: str = "both"
    input_limit: float = 1.0
    offset_limit: float = 2.0
    start: str = "cycle"
    kick: float = 0.05
    gate: float = 0.0
    control_timestep: float = 0.02
    time_limit: float = 20.0
    margin: float = 0.5

    def __post_init__(self) -> None:
        choices = {"actions": ACTIONS, "start": STARTS}
        for name, valid in choices.items():
            if getattr(self, name) not in valid:
                raise UnknownNameError(name, getattr(self, name), valid)
        require_duration("time_limit", self.time_limit)
        for name in ("input_limit", "offset_limit", "margin"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("kick", self.kick, 0.0)
        require_number("gate", self.gate, 0.0)
        require_number("control_timestep", self.control_timestep, 0.0, open_low=True)

    def check_step(self, timestep: float) -> None:
        """Raise unless the time between actions is a multiple of the physics' step [s].

        Raises:
            InvalidArgumentError: it is not.
        """
        steps = self.control_timestep / timestep
        if round(steps) < 1 or abs(steps - round(steps)) > 1e-8:  # dm_control's tolerance
            raise InvalidArgumentError(
                "control_timestep", f"a multiple of {timestep:g} s", self.control_timestep
            )

    def limits(self, largest: float) -> tuple[float, float]:
        """Largest size of an action on inputs and on fed-back outputs; 0: no action.

        Args:
            largest: value of the target.
        """
        inputs = 0.0 if self.actions == "offsets" else self.input_limit
        return inputs, 0.0 if self.actions == "inputs" else self.offset_limit * largest
