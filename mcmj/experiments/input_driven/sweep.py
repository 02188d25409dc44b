"""A slow sweep of the input down and up again: does the rhythm depend on the way?"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.metrics.cycles import Cycles, cycles
from mcmj.targets.input_profiles import Profile
from mcmj.utils.validation import Array

GRID = 40  # inputs at which both ways are compared
NAMES = tuple(
    name
    for word in ("amplitude", "frequency")
    for name in (f"{word}_hysteresis", f"target_{word}_hysteresis", f"{word}_error")
)


@dataclass(frozen=True)
class Branch:
    """One way of a sweep, by increasing input: inputs (C,), amplitudes and frequencies [Hz]."""

    inputs: Array
    amplitudes: Array
    frequencies: Array

    def at(self, name: str, inputs: Array) -> Array:
        """Amplitudes or frequencies, interpolated at inputs in the logarithm."""
        found: Array = np.interp(np.log(inputs), np.log(self.inputs), getattr(self, name))
        return found


@dataclass(frozen=True)
class Sweep:
    """Body and target under the same sweep; the target's own lag is what a body should show.

    Attributes:
        body, target: (down, up).
    """

    body: tuple[Branch, Branch]
    target: tuple[Branch, Branch]

    def differences(self, lowest: float = 0.0) -> dict[str, Any]:
        """Largest differences over the inputs from `lowest` on that all branches reach.

        <quantity>_hysteresis: |down - up| of the body over the target's mean of both;
        target_<quantity>_hysteresis: of the target itself; <quantity>_error: |body - target| /
        target on the same way; inputs: the range compared. Infinite where the rhythm was lost.
        """
        branches = [*self.body, *self.target]
        if any(len(branch.inputs) < 2 for branch in branches):
            return {"inputs": None, **dict.fromkeys(NAMES, np.inf)}
        low = max(lowest, *(branch.inputs[0] for branch in branches))
        high = min(branch.inputs[-1] for branch in branches)
        if low >= high:
            return {"inputs": None, **dict.fromkeys(NAMES, np.inf)}
        grid = np.geomspace(low, high, GRID)
        values: list[float] = []
        for quantity in ("amplitudes", "frequencies"):
            body = np.array([branch.at(quantity, grid) for branch in self.body])
            target = np.array([branch.at(quantity, grid) for branch in self.target])
            scale = target.mean(axis=0)
            apart = ((body[1] - body[0]) / scale, (target[1] - target[0]) / scale)
            values += [float(np.abs(d).max()) for d in (*apart, body / target - 1.0)]
        return {"inputs": (float(low), float(high)), **dict(zip(NAMES, values, strict=True))}


def branches(profile: Profile, values: Array, timestep: float) -> tuple[Branch, Branch]:
    """The ways down and up of a sweep of two ramps, from a signal (T,) under it."""
    found = cycles(values, timestep)
    middle = profile.starts[1]
    inputs = profile(found.times)
    down, up = found.times < middle, found.times > middle
    return _branch(inputs, found, down), _branch(inputs, found, up)


def _branch(inputs: Array, found: Cycles, rows: np.ndarray) -> Branch:
    order = np.flatnonzero(rows)[np.argsort(inputs[rows], kind="stable")]
    return Branch(inputs[order], found.amplitudes[order], found.frequencies[order])
