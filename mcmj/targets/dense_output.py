"""DOP853's solution between its steps: the integrator's own polynomials, compiled.

Between t_i and t_i + h_i, with x = (t - t_i) / h_i (Hairer, Norsett and Wanner 1993, II.6),

    y(t) = y_i + x (F_0 + (1 - x) (F_1 + x (F_2 + (1 - x) (F_3 + ..))))
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from mcmj.utils.validation import Array


@dataclass(frozen=True, eq=False)
class DenseOutput:
    """y(t) from the first knot to the last.

    Attributes:
        knots: (S + 1,) ends of the integrator's steps [s].
        starts: (S, n) y at their beginnings.
        terms: (S, 7, n) the F of every step.
    """

    knots: Array
    starts: Array
    terms: Array

    @classmethod
    def of(cls, solution: Any) -> "DenseOutput":
        """From what solve_ivp gave for method DOP853 with dense_output."""
        steps = solution.sol.interpolants
        return cls(
            np.ascontiguousarray(solution.sol.ts),
            np.array([step.y_old for step in steps]),
            np.array([step.F for step in steps]),
        )

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> "DenseOutput":
        """From `arrays`."""
        return cls(arrays["knots"], arrays["starts"], arrays["terms"])

    @property
    def arrays(self) -> dict[str, Array]:
        """All of it, by name."""
        return {"knots": self.knots, "starts": self.starts, "terms": self.terms}

    def until(self, time: float) -> "DenseOutput":
        """The steps that reach a time [s]."""
        steps = int(np.searchsorted(self.knots, time))
        return DenseOutput(self.knots[: steps + 1], self.starts[:steps], self.terms[:steps])

    def __call__(self, times: Array) -> Array:
        """y (T, n) at times (T,) [s]; outside, the first or last polynomial goes on."""
        at = np.ascontiguousarray(times, dtype=np.float64)
        values = np.empty((len(at), self.starts.shape[1]))
        _evaluate(self.knots, self.starts, self.terms, at, values)
        return values


@njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(knots, starts, terms, times, values):
    """Fill values (T, n); times in order find their step at once."""
    last, i = knots.size - 2, 0
    for k in range(times.size):
        t = times[k]
        if not (knots[i] < t <= knots[i + 1]):
            if i < last and knots[i + 1] < t <= knots[i + 2]:
                i += 1
            else:
                i = min(max(np.searchsorted(knots, t) - 1, 0), last)
        x = (t - knots[i]) / (knots[i + 1] - knots[i])
        for c in range(values.shape[1]):
            y = 0.0
            for j in range(terms.shape[1] - 1, -1, -1):
                y += terms[i, j, c]
                y *= 1.0 - x if j % 2 else x
            values[k, c] = y + starts[i, c]
