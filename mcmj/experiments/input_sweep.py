"""A slow sweep of the input down and up again: does the rhythm depend on the way?"""

from dataclasses import dataclass

import numpy as np

from mcmj.profiles import Profile
from mcmj.rhythm import Cycles, cycles
from mcmj.validation import Array

GRID = 40  # inputs at which both ways are compared


@dataclass(frozen=True)
class Branch:
    """One way of a sweep, by increasing input: inputs (C,), amplitudes and frequencies [Hz]."""

    inputs: Array
    amplitudes: Array
    frequencies: Array

    def at(self, name: str, inputs: Array) -> Array:
        """Amplitudes or frequencies, interpolated at inputs in the logarithm."""
        return np.interp(np.log(inputs), np.log(self.inputs), getattr(self, name))


@dataclass(frozen=True)
class Sweep:
    """Body and target under the same sweep; the target's own lag is what a body should show.

    Attributes:
        body, target: (down, up).
    """

    body: tuple[Branch, Branch]
    target: tuple[Branch, Branch]

    @property
    def metrics(self) -> dict[str, float]:
        """Largest differences, over the inputs that all branches reach.

        <quantity>_hysteresis: |down - up| / the target's mean of both, of the body;
        target_<quantity>_hysteresis: of the target itself; <quantity>_error: |body - target| /
        target, on the same way. Infinite where the rhythm was lost.
        """
        branches = [*self.body, *self.target]
        lost = any(len(branch.inputs) < 2 for branch in branches)
        low = np.inf if lost else max(branch.inputs[0] for branch in branches)
        high = 0.0 if lost else min(branch.inputs[-1] for branch in branches)
        table = {}
        for name in ("amplitudes", "frequencies"):
            word = {"amplitudes": "amplitude", "frequencies": "frequency"}[name]
            keys = (f"{word}_hysteresis", f"target_{word}_hysteresis", f"{word}_error")
            if low >= high:
                table.update(dict.fromkeys(keys, np.inf))
                continue
            grid = np.geomspace(low, high, GRID)
            body = np.array([branch.at(name, grid) for branch in self.body])
            target = np.array([branch.at(name, grid) for branch in self.target])
            scale = target.mean(axis=0)
            values = (
                np.abs(body[0] - body[1]) / scale,
                np.abs(target[0] - target[1]) / scale,
                np.abs(body / target - 1.0),
            )
            table.update({key: float(v.max()) for key, v in zip(keys, values, strict=True)})
        return table


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
