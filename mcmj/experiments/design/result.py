"""What came of the designs: how many bodies learn a task, drawn, searched at random, designed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.experiments.design.config import Config
from mcmj.experiments.design.fronts import Fronts
from mcmj.experiments.design.predictors import Predictors
from mcmj.metrics.success_rates import success_rate
from mcmj.utils.validation import Array

KINDS = {
    "random": "drawn at random",
    "search": "random search",
    "designed": "designed",
}


@dataclass(frozen=True)
class Designs:
    """Bodies of consecutive seeds and one number of nodes.

    Attributes:
        bodies: the metrics of every trial.
        threshold: largest orbit error of a success.
    """

    bodies: Sequence[Mapping[str, Any]]
    threshold: float

    def successes(self, kind: str) -> int:
        """How many bodies of a kind learn the task under noise that no search has seen."""
        return sum(body[kind]["success"] for body in self.bodies)

    def errors(self, kind: str) -> Array:
        """(bodies,) the worst orbit errors; infinite where a body blew up."""
        return np.array([_worst(body[kind]["orbit_errors"]) for body in self.bodies])

    @property
    def evaluations(self) -> list[int]:
        """Bodies tried for each design."""
        return [body["evaluations"] for body in self.bodies]

    @property
    def search_evaluations(self) -> list[int]:
        """Bodies tried for each search at random, of as many as a design may try."""
        return [body["search_evaluations"] for body in self.bodies]

    @property
    def best(self) -> Mapping[str, Any] | None:
        """The designed body with the smallest error; one that was good as drawn, if all were."""
        errors = self.errors("designed")
        good = [k for k, body in enumerate(self.bodies) if body["designed"]["success"]]
        order = sorted(good, key=lambda k: (self.evaluations[k] == 1, errors[k]))
        return self.bodies[order[0]] if order else None

    @property
    def metrics(self) -> dict[str, object]:
        """As JSON types."""
        # None: not known of any, or a run that blew up
        exact = [b["dop853_error"] for b in self.bodies if b["dop853_error"] is not None]
        return {
            **{f"{kind}_successes": self.successes(kind) for kind in KINDS},
            "of": len(self.bodies),
            "designed_interval_95": success_rate(
                [body["designed"]["success"] for body in self.bodies]
            )["interval_95"],
            "seconds_per_body": float(np.mean([body["seconds"] for body in self.bodies])),
            "evaluations": self.evaluations,
            "search_evaluations": self.search_evaluations,
            "mujoco_agreement": float(np.mean([body["mujoco_agrees"] for body in self.bodies])),
            "dop853_confirmed": sum(error < self.threshold for error in exact),
            "dop853_of": self.successes("designed") if exact else 0,
            **{f"{kind}_orbit_errors": self.errors(kind) for kind in KINDS},
        }


@dataclass(frozen=True)
class Result:
    """What the parts found.

    Attributes:
        bodies: designs of the part bodies.
        smallest: those of the part smallest, by task and number of nodes.
        predictors: what tells success beforehand.
        fronts: exact or robust.
    """

    config: Config
    bodies: Designs | None
    smallest: dict[str, dict[int, Designs]]
    predictors: Predictors | None = None
    fronts: Fronts | None = None

    def fewest(self, task: str, kind: str) -> int | None:
        """Fewest nodes with which a body of a kind learned a task; None: none did."""
        sizes = self.smallest[task]
        return min((n for n, found in sizes.items() if found.successes(kind)), default=None)

    @property
    def champions(self) -> dict[str, str]:
        """MJCF by file name: the best of the part bodies, the smallest for every task."""
        chosen = {"designed": self.bodies}
        for task, sizes in self.smallest.items():
            if (nodes := self.fewest(task, "designed")) is not None:
                chosen["smallest_" + re.sub(r"[^\w-]", "_", task)] = sizes[nodes]
        best = {name: found.best for name, found in chosen.items() if found is not None}
        return {name: body["xml"] for name, body in best.items() if body is not None}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        task = self.config.task
        table: dict[str, object] = {}
        if self.bodies is not None:
            table[task] = self.bodies.metrics
        if self.smallest:
            table["smallest"] = {
                one: {
                    **{kind: self.fewest(one, kind) for kind in KINDS},
                    "by_nodes": {str(n): found.metrics for n, found in sizes.items()},
                }
                for one, sizes in self.smallest.items()
            }
        if self.predictors is not None:
            table["predictors"] = {task: self.predictors.metrics}
        if self.fronts is not None:
            noise = {"sensor_noise": self.config.sensor_noise}
            table["pareto"] = {task: {**noise, **self.fronts.metrics}}
        return table


def _worst(errors: Sequence[float | None]) -> float:
    return max(np.inf if error is None else error for error in errors)
