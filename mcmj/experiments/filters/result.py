"""How well a body filters, beside regression without a body."""

from dataclasses import dataclass

from mcmj.experiments.filters.config import Config
from mcmj.experiments.filters.switching import SwitchResult
from mcmj.targets.filter_tasks import FilterTask
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class FilterResult:
    """One task.

    Attributes:
        task: what was asked.
        errors: on held-out data, nrmse_std of the body, baseline_nrmse_std of regression on
            the input and its delays, input_only_nrmse_std of that on the input alone.
        outputs, wanted: (M, 1) the body's and the target's held-out values.
    """

    task: FilterTask
    errors: dict[str, float]
    outputs: Array
    wanted: Array


@dataclass(frozen=True)
class Result:
    """What was measured."""

    config: Config
    filters: dict[str, FilterResult]
    switch: SwitchResult | None

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {name: r.errors for name, r in self.filters.items()}
        if self.switch is not None:
            table["switch"] = self.switch.metrics
        return table
