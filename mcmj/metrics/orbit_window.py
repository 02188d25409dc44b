"""The orbit error of the recent past, updated sample by sample, for rewards."""

import numpy as np
from scipy.spatial import cKDTree

from mcmj.metrics.orbits import rms_radius
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

FINE, COARSE = 2048, 64  # points of the target: what outputs are near to; what must be covered


class OrbitWindow:
    """Orbit error (mcmj.metrics) of the outputs of the last period, or of all since the start.

    Distances are to the nearest sample, not to the nearest point between samples, so the error
    cannot fall below about half the distance between consecutive outputs.

    Args:
        target: the orbit.
        interval: between samples [s].

    Raises:
        InvalidArgumentError: fewer than 8 samples a period.
    """

    def __init__(self, target: Target, interval: float) -> None:
        samples = round(target.period / interval)
        if samples < 8:
            raise InvalidArgumentError("interval", f"at most {target.period / 8:.3g} s", interval)
        self._tree = cKDTree(target.orbit(FINE))
        self._orbit = target.orbit(COARSE)
        self._radius = rms_radius(self._orbit)
        self._there = np.zeros(samples)  # squared distances of outputs to the orbit
        self._back = np.zeros((COARSE, samples))  # and of its points to each of the outputs
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        self._seen = 0
        self._there[:], self._back[:] = np.nan, np.inf

    def add(self, outputs: Array) -> None:
        """Take one sample (n_outputs,) more."""
        column = self._seen % len(self._there)
        self._there[column] = self._tree.query(outputs)[0] ** 2
        self._back[:, column] = ((self._orbit - outputs) ** 2).sum(axis=1)
        self._seen += 1

    @property
    def error(self) -> float:
        """RMS distance of outputs to orbit, or of orbit to outputs, the larger; 1: the radius."""
        if self._seen == 0:
            return float("inf")
        there = self._there[: self._seen].mean()
        return float(np.sqrt(max(there, self._back.min(axis=1).mean())) / self._radius)
