"""Targets with an input: x' = f(x, u(t)), whose limit cycle depends on the input u."""

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mcmj.targets.input_profiles import Profile, Ramp
from mcmj.targets.limit_cycles import Target, integrate, quadratic, quadratic_flow
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class DrivenSystem:
    """A system that an input moves from one limit cycle to another.

    Attributes:
        name: for figures and files.
        flow: f of x' = f(x, u): x (n_outputs,) and a number u -> (n_outputs,).
        cycle: its limit cycle at a constant input.
    """

    name: str
    flow: Callable[[Array, float], Array] = field(repr=False)
    cycle: Callable[[float], Target] = field(repr=False)

    def follow(self, profile: Profile, start: Array | None = None) -> Callable[[Array], Array]:
        """x(t) under u(t) = profile(t), by DOP853, restarted where the profile has a kink.

        Args:
            profile: u(t).
            start: x(0), (n_outputs,); default: on the limit cycle of the profile's first value.

        Returns:
            Times (T,) [s] within the profile's duration -> (T, n_outputs).

        Raises:
            InvalidArgumentError: (by what is returned) times outside the profile.
            McmjError: the system cannot be integrated, or has no cycle to start on.
        """
        if start is None:
            start = self.cycle(profile.ramps[0].start).sample([0.0])[0]
        pieces: list[Callable[[Array], Array]] = []
        for ramp in profile.ramps:

            def flow(t: float, x: Array, u: Ramp = ramp) -> Array:
                return self.flow(x, float(u(t)))

            solution = integrate(flow, start, ramp.duration, dense_output=True)
            pieces.append(solution.sol)
            start = solution.y[:, -1]
        return functools.partial(_sample, profile, pieces, len(start))


def _sample(
    profile: Profile, pieces: list[Callable[[Array], Array]], n_outputs: int, times: Array
) -> Array:
    at = np.asarray(times, dtype=np.float64)
    outside = np.flatnonzero((at < 0) | (at > profile.duration))
    if outside.size:
        raise InvalidArgumentError(
            "times", f"times from 0 to {profile.duration:g} s", f"{at[outside[0]]:g} s"
        )
    which = np.searchsorted(profile.starts, at, side="right") - 1
    values = np.empty((len(at), n_outputs))
    for index in np.unique(which):
        mine = which == index
        values[mine] = pieces[index](at[mine] - profile.starts[index]).T
    return values


QUADRATIC = DrivenSystem("quadratic", quadratic_flow, functools.cache(quadratic))
