"""Largest stable steps, measured and predicted."""

from dataclasses import dataclass

from mcmj.experiments.hard_cases.config import Config

STEPS = ("measured", "at_rest", "low", "high", "resolved")  # columns of a row


@dataclass(frozen=True)
class Row:
    """One case under one integrator; steps in s.

    Attributes:
        measured: largest stable step; infinite if none fails that resolves the motion.
        at_rest, low, high: predictions, see mcmj.experiments.hard_cases.run.
        resolved: the longest step that resolves the motion.
    """

    case: str
    integrator: str
    measured: float
    at_rest: float
    low: float
    high: float
    resolved: float

    @property
    def bracketed(self) -> bool:
        """Whether the bracket holds the measured limit, as far as steps resolve the motion."""
        low, high = (min(step, self.resolved) for step in (self.low, self.high))
        return low <= min(self.measured, self.resolved) <= high


@dataclass(frozen=True)
class Result:
    """All rows, and the largest elongation [m] and rate [m/s] in every case."""

    config: Config
    rows: tuple[Row, ...]
    amplitudes: dict[str, tuple[float, float]]

    @property
    def metrics(self) -> dict[str, object]:
        """metrics.<case>.<integrator>: steps in ms, and how they compare; null: unbounded."""
        table: dict[str, object] = {}
        for case in self.config.cases:
            elongation, speed = self.amplitudes[case]
            entry: dict[str, object] = {"elongation": elongation, "speed": speed}
            for row in self.rows:
                if row.case == case:
                    entry[row.integrator] = {
                        f"{name}_ms": 1e3 * getattr(row, name) for name in STEPS
                    } | {"bracketed": row.bracketed}
            table[case] = entry
        return table
