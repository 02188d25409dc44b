"""How well a body filters, beside regression without a body."""

from dataclasses import dataclass

from mcmj.experiments.filters.config import Config
from mcmj.experiments.filters.switching import SwitchResult
from mcmj.learning.filters import FilterResult


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
