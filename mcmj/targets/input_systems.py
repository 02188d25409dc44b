"""Targets with an input: x' = f(x, u(t)), whose limit cycle depends on the input u."""

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mcmj.targets.dense_output import DenseOutput
from mcmj.targets.input_profiles import Profile, Ramp
from mcmj.targets.kept_arrays import kept_arrays
from mcmj.targets.limit_cycles import (
    ATOL,
    RTOL,
    Target,
    code_digest,
    integrate,
    quadratic,
    quadratic_flow,
)
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class DrivenSystem:
    """A system that an input moves from one limit cycle to another.

    Attributes:
        name: for figures and files.
        flow: f of x' = f(x, u): x (n_outputs,) and a number u -> (n_outputs,).
        cycle: its limit cycle at a constant input.
        kept: the flow is defined in mcmj.targets: solutions are kept on the disk.
    """

    name: str
    flow: Callable[[Array, float], Array] = field(repr=False)
    cycle: Callable[[float], Target] = field(repr=False)
    kept: bool = False

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
        first = np.asarray(start, dtype=np.float64)

        def solve() -> dict[str, Array]:
            pieces = self._pieces(profile, first)
            return {f"{i} {k}": v for i, one in enumerate(pieces) for k, v in one.arrays.items()}

        if self.kept:
            asked = [self.name, str(profile), first, RTOL, ATOL]
            arrays = kept_arrays("driven", [asked, code_digest()], solve)
        else:
            arrays = solve()
        pieces = [
            DenseOutput(*(arrays[f"{i} {name}"] for name in ("knots", "starts", "terms")))
            for i in range(len(profile.ramps))
        ]
        return functools.partial(_sample, profile, pieces, len(first))

    def _pieces(self, profile: Profile, start: Array) -> list[DenseOutput]:
        """The solution along every ramp."""
        pieces = []
        for ramp in profile.ramps:

            def flow(t: float, x: Array, u: Ramp = ramp) -> Array:
                return self.flow(x, float(u(t)))

            solution = integrate(flow, start, ramp.duration, dense_output=True)
            pieces.append(DenseOutput.of(solution))
            start = solution.y[:, -1]
        return pieces


def _sample(profile: Profile, pieces: list[DenseOutput], n_outputs: int, times: Array) -> Array:
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
        values[mine] = pieces[index](at[mine] - profile.starts[index])
    return values


QUADRATIC = DrivenSystem("quadratic", quadratic_flow, functools.cache(quadratic), kept=True)
