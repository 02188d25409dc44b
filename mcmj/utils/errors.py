"""Errors of mcmj: one base class, messages that say what was expected and what came."""

from collections.abc import Iterable


class McmjError(Exception):
    """Base class of every error that mcmj raises on purpose."""


class InvalidArgumentError(McmjError, ValueError):
    """An argument with a wrong value: names it, what was expected and what came."""

    def __init__(self, name: str, expected: str, got: object) -> None:
        self.name = name
        super().__init__(f"{name}: expected {expected}, got {got}")


class UnknownNameError(McmjError, ValueError):
    """A name that is not one of the valid choices, which the message lists."""

    def __init__(self, kind: str, got: object, choices: Iterable[str]) -> None:
        self.choices = sorted(choices)
        super().__init__(f"unknown {kind} {got!r}; valid choices: {', '.join(self.choices)}")


class BodyFileError(McmjError, ValueError):
    """A file or string that is not an mcmj body in MJCF."""


class TrajectoryFileError(McmjError, ValueError):
    """A file or folder that is not a trajectory of mcmj's."""


class DivergenceError(McmjError, ArithmeticError):
    """A simulation blew up: says when, where, under which integrator, and what to try.

    Attributes:
        time: simulation time of the last good step [s].
        steps_done: number of good steps of this rollout.
    """

    def __init__(self, message: str, time: float, steps_done: int) -> None:
        self.time = time
        self.steps_done = steps_done
        super().__init__(message)

    def after(self, steps: int) -> "DivergenceError":
        """The same error in a rollout that had done so many steps before."""
        return DivergenceError(str(self), self.time, self.steps_done + steps)


class OutputError(McmjError, OSError):
    """A folder or file that cannot be written."""


class CheckpointError(McmjError, ValueError):
    """A checkpoint that cannot be gone on from: damaged, or not readable."""


class MissingExtraError(McmjError, ImportError):
    """A package of one of mcmj's extras cannot be imported: says how to install it."""

    def __init__(self, purpose: str, extra: str, reason: object) -> None:
        self.extra = extra
        super().__init__(f"{purpose}: pip install 'mcmj[{extra}]' ({reason})")


class PackageError(McmjError, OSError):
    """MuJoCo's WebAssembly package is another one, or cannot be fetched: says how to get it."""


class McmjWarning(UserWarning):
    """Base class of every warning that mcmj gives."""


class StabilityWarning(McmjWarning):
    """A simulation that will blow up: its step is above the integrator's stability limit."""


class OtherPhysicsWarning(McmjWarning):
    """A run that does not take the step, integrator, springs or delay of its body file."""


class StoreError(McmjError, ValueError):
    """A store of trials that cannot be used: damaged, of another version, or something else."""
