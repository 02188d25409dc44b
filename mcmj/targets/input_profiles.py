"""Profiles of one input over time: ramps and holds, one after the other.

    Profile.parse("log 0.1 5 320, log 5 0.1 120, lin 0.1 5 240, hold 5 120")

is the geometric ramp from 0.1 to 5 in 320 s, a faster one back, a linear ramp and a constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_number

KINDS = {
    "lin": "lin START STOP SECONDS",
    "log": "log START STOP SECONDS",
    "hold": "hold VALUE SECONDS",
}


@dataclass(frozen=True)
class Ramp:
    """u(t) = start + (stop - start) t / duration, or start (stop / start)^(t / duration).

    Written so that both ends are exact.

    Attributes:
        start, stop: values at both ends; positive if geometric.
        duration: [s].
        geometric: equal ratios in equal times instead of equal differences.

    Raises:
        InvalidArgumentError: a number out of bounds.
    """

    start: float
    stop: float
    duration: float
    geometric: bool = False

    def __post_init__(self) -> None:
        for name in ("start", "stop"):
            value = getattr(self, name)
            if self.geometric:
                require_number(f"{name} of a geometric ramp", value, 0.0, open_low=True)
            else:
                require_number(name, value, -np.inf)
        require_number("duration", self.duration, 0.0, open_low=True)

    def __call__(self, times: npt.ArrayLike) -> Array:
        """u (T,) at times (T,) [s]; before 0 and after the duration it stays at its ends."""
        share = np.clip(np.asarray(times, dtype=np.float64) / self.duration, 0.0, 1.0)
        if self.geometric:
            return self.start ** (1.0 - share) * self.stop**share
        return self.start * (1.0 - share) + self.stop * share

    def __str__(self) -> str:
        if self.start == self.stop:
            return f"hold {self.start!r} {self.duration!r}"
        kind = "log" if self.geometric else "lin"
        return f"{kind} {self.start!r} {self.stop!r} {self.duration!r}"


def hold(value: float, duration: float) -> Ramp:
    """A constant."""
    return Ramp(value, value, duration)


class Profile:
    """Ramps one after the other; where they do not meet, the input jumps.

    Raises:
        InvalidArgumentError: no ramp, or something else than ramps.
    """

    def __init__(self, ramps: Sequence[Ramp]) -> None:
        self.ramps = tuple(ramps)
        if not self.ramps or not all(isinstance(ramp, Ramp) for ramp in self.ramps):
            raise InvalidArgumentError("ramps", "at least one Ramp, and only ramps", ramps)
        ends = np.cumsum([ramp.duration for ramp in self.ramps])
        self.starts: Array = np.concatenate([[0.0], ends[:-1]])
        self.duration = float(ends[-1])

    @classmethod
    def parse(cls, text: str) -> "Profile":
        """A profile from text like "log 0.1 5 320, hold 5 120"; `str` gives it back.

        Raises:
            InvalidArgumentError: text that is not a profile.
        """
        return cls([_parse_ramp(part) for part in text.split(",")])

    def __call__(self, times: npt.ArrayLike) -> Array:
        """u (T,) at times (T,) [s]; the later ramp's where two touch, constant outside."""
        at = np.asarray(times, dtype=np.float64)
        which = np.maximum(np.searchsorted(self.starts, at, side="right") - 1, 0)
        values = np.empty(at.shape)
        for index, (ramp, start) in enumerate(zip(self.ramps, self.starts, strict=True)):
            mine = which == index
            values[mine] = ramp(at[mine] - start)
        return values

    @property
    def low(self) -> float:
        """Smallest value."""
        return min(min(ramp.start, ramp.stop) for ramp in self.ramps)

    @property
    def high(self) -> float:
        """Largest value."""
        return max(max(ramp.start, ramp.stop) for ramp in self.ramps)

    @property
    def last(self) -> float:
        """Value at the end."""
        return self.ramps[-1].stop

    def __str__(self) -> str:
        return ", ".join(str(ramp) for ramp in self.ramps)

    def __repr__(self) -> str:
        return f"Profile.parse({str(self)!r})"


def _parse_ramp(text: str) -> Ramp:
    kind, *words = text.split() or [""]
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if kind not in KINDS or len(numbers) != len(KINDS[kind].split()) - 1:
        raise InvalidArgumentError("profile", f"parts like {', '.join(KINDS.values())}", repr(text))
    return Ramp(numbers[0], numbers[-2], numbers[-1], geometric=kind == "log")
