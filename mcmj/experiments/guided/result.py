"""What a guided search found, and how it does on other bodies."""

from dataclasses import dataclass

import numpy as np

from mcmj.experiments.guided.config import OBJECTIVES, Config
from mcmj.metrics.success_rates import success_rate
from mcmj.search.overrides import value_at
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Result:
    """A finished guided search.

    Attributes:
        tried: settings and objectives in order.
        best: the best setting.
        judged: scores (bodies,) on other bodies, of "hand-chosen" and "guided".
        confirmed: the latter's of the first of these bodies in MuJoCo; empty without a choice
            of engine.
    """

    config: Config
    tried: list[tuple[dict[str, object], float]]
    best: dict[str, object]
    judged: dict[str, Array]
    confirmed: Array

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        score = self.config.target
        judge = OBJECTIVES[self.config.objective]
        table: dict[str, object] = {
            "settings": len(self.tried),
            "best": {"setting": self.best, "objective": self._best_objective},
            "hand_chosen": {path: value_at(self.config.hand_chosen, path) for path in self.best},
            "objectives": [objective for _, objective in self.tried],
        }
        for name, scores in self.judged.items():
            table[name.replace("-", "_") + "_on_other_bodies"] = {
                **success_rate([score.succeeds(x) for x in scores]),
                "median_score": float(np.median(scores)),
                "objective": judge(scores, score),
                "scores": scores,
            }
        if self.confirmed.size:
            pairs = zip(self.confirmed, self.judged["guided"], strict=False)
            table["confirmed"] = self.confirmed.size
            table["twin_mujoco_agreement"] = float(
                np.mean([score.succeeds(a) == score.succeeds(b) for a, b in pairs])
            )
        return table

    @property
    def _best_objective(self) -> float:
        values = [objective for _, objective in self.tried]
        return max(values) if self.config.large_is_good else min(values)
