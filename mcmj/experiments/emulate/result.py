"""Errors and orders of emulated systems."""

from dataclasses import dataclass

from mcmj.experiments.emulate.config import REPORTED, Config
from mcmj.metrics.convergence import Order, observed_order
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Cell:
    """One target, integrator and step: the error, infinite where it blew up."""

    error: float


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes:
        cells: [target][integrator][step_ms].
        orders: [target][integrator], None where too few steps were usable.
        orbits: [target] states (T, n) of the body at 1 ms under the last integrator, and those
            of the target.
        held_at_start: the driven target's errors [integrator][step_ms] with inputs sampled at
            the start of each step instead of its middle.
        mismatch_errors: Van der Pol's, by the share of p and q that K does not know.
    """

    config: Config
    cells: dict[str, dict[str, dict[float, Cell]]]
    orders: dict[str, dict[str, Order | None]]
    orbits: dict[str, tuple[Array, Array]]
    held_at_start: dict[str, dict[float, Cell]]
    mismatch_errors: dict[float, float]

    @property
    def slopes(self) -> dict[str, dict[str, float | None]]:
        """Observed order by target and integrator."""
        return {t: {m: _slope(order) for m, order in o.items()} for t, o in self.orders.items()}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {}
        for target, methods in self.cells.items():
            table[target] = {
                name: {
                    "error": steps[REPORTED].error,
                    "order": self.slopes[target][name],
                    "errors": {f"{step:g}": cell.error for step, cell in steps.items()},
                }
                for name, steps in methods.items()
            }
        table["input_held_from_start"] = {
            name: {
                "error": steps[REPORTED].error,
                "order": _slope(observed_order({"driven": {name: steps}}, name)),
            }
            for name, steps in self.held_at_start.items()
        }
        table["mismatch"] = {f"{size:g}": error for size, error in self.mismatch_errors.items()}
        return table


def _slope(order: Order | None) -> float | None:
    return order.slope if order else None
