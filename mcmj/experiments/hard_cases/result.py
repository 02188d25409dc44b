"""Largest stable steps, measured and predicted."""

from dataclasses import dataclass

from mcmj.experiments.hard_cases.config import Config

STEPS = ("measured", "at_rest", "safe", "blow_up")  # columns of a row


@dataclass(frozen=True)
class Row:
    """One case under one integrator; steps in s, infinite if none up to 1 s fails.

    Attributes:
        measured: largest stable step.
        at_rest, safe, blow_up: predictions, see mcmj.experiments.hard_cases.run.
    """

    case: str
    integrator: str
    measured: float
    at_rest: float
    safe: float
    blow_up: float


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
                    } | {"measured_over_blow_up": row.measured / row.blow_up}
            table[case] = entry
        return table
