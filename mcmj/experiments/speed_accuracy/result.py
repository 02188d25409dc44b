"""Errors and costs of integrators, and which of them to recommend."""

from dataclasses import dataclass

from mcmj.experiments.speed_accuracy.config import Config
from mcmj.metrics.convergence import Order


@dataclass(frozen=True)
class Cell:
    """One body, method and step: errors (inf where it blew up) at the horizons, and the cost."""

    position_errors: tuple[float, ...]
    length_error: float
    us_per_second: float
    cost_ratio: float

    @property
    def error(self) -> float:
        """Relative position error at the last horizon."""
        return self.position_errors[-1]

    @property
    def stable(self) -> bool:
        """It did not blow up, and is not all wrong."""
        return self.error < 1.0


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes:
        cells: [body][method][step_ms].
        orders: observed order by method; None where too few steps were usable, or parts of steps
            set the error.
        self_consistency: by body, how far DOP853 at rtol 1e-12 is from a run at 5e-13.
        attractor: [task]["A_to_B"] orbit errors of readouts taught under A and run under B.
    """

    config: Config
    cells: dict[str, dict[str, dict[float, Cell]]]
    orders: dict[str, Order | None]
    self_consistency: dict[str, float]
    attractor: dict[str, dict[str, float]]

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {
            body: {
                method: {
                    f"{step:g}": {
                        "error": cell.error,
                        "errors_at_horizons": cell.position_errors,
                        "length_error": cell.length_error,
                        "us_per_simulated_second": cell.us_per_second,
                        "cost_ratio": cell.cost_ratio,
                        "stable": cell.stable,
                    }
                    for step, cell in steps.items()
                }
                for method, steps in methods.items()
            }
            for body, methods in self.cells.items()
        }
        table["order"] = {
            name: order.slope if order else None for name, order in self.orders.items()
        }
        table["order_fitted_on_ms"] = {
            name: order.steps_ms if order else None for name, order in self.orders.items()
        }
        table["reference_self_consistency"] = max(self.self_consistency.values())
        table["attractor_orbit_error"] = self.attractor
        table["recommendation"] = {body: recommend(cells) for body, cells in self.cells.items()}
        return table


def recommend(
    methods: dict[str, dict[float, Cell]],
    wanted: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8),
) -> dict[str, str | None]:
    """The cheapest MuJoCo method and step for each wanted error."""
    choice: dict[str, str | None] = {}
    for goal in wanted:
        good = [
            (cell.cost_ratio, f"{method.removeprefix('mujoco_')} at {step:g} ms")
            for method, steps in methods.items()
            for step, cell in steps.items()
            if method.startswith("mujoco_") and cell.error <= goal
        ]
        choice[f"{goal:g}"] = min(good)[1] if good else None
    return choice
