"""Free runs of the tasks that a body learned, and their errors."""

from dataclasses import dataclass
from typing import Any

from mcmj.core.body import Body
from mcmj.experiments.limit_cycle.config import Config
from mcmj.experiments.limit_cycle.seeds import SuccessOfSeeds
from mcmj.learning.regression import Fit
from mcmj.targets.limit_cycles import Target
from mcmj.utils.checkpoint import Checkpoint
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class TaskResult:
    """One task: the fit (None if the readout came with the file), the free run, its errors.

    Attributes:
        times, outputs: (T,) [s] and (T, n_outputs) of the free run; its time goes on from
            teacher forcing, so the target's value at the same moment is target.sample(times).
        positions: (window, N, 2) of the nodes during the last window [m]; None from the twin.
        windows: errors in consecutive windows, see mcmj.learning.free_run.window_errors.
    """

    target: Target
    w_out: Array
    fit: Fit | None
    times: Array
    outputs: Array
    positions: Array | None
    errors: dict[str, float]
    windows: dict[str, object]


@dataclass(frozen=True)
class Result:
    """All tasks of one body, and what the closed loop costs, if that was measured.

    Attributes:
        stepping: arguments of the Simulation; its time step is a half or a quarter of the
            config's if the body blew up with that.
        tasks: without those on which one of several bodies blew up.
        seeds: how all bodies did, if there are several.
    """

    config: Config
    body: Body
    source: dict[str, object]
    stepping: dict[str, Any]
    tasks: dict[str, TaskResult]
    checkpoints: dict[str, Checkpoint]
    steps_per_second: float | None
    closed_loop_cost_ratio: float | None
    seeds: SuccessOfSeeds | None = None

    @property
    def readouts(self) -> dict[str, Array]:
        """Readouts (L or L + 1, n_outputs) by task."""
        return {name: task.w_out for name, task in self.tasks.items()}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, Any] = {}
        for name, task in self.tasks.items():
            fit = task.fit
            table[name] = {
                **task.errors,
                "train_nrmse": fit.train_nrmse if fit else None,
                "condition_number": fit.condition_number if fit else None,
                "windows": task.windows,
            }
        if self.seeds is not None:
            for name, row in self.seeds.metrics.items():
                table[name] = {**table.get(name, {}), **row}
            table["best_seed"] = self.seeds.best_seed
        table["timestep"] = self.stepping["timestep"]
        table["steps_per_second"] = self.steps_per_second
        table["closed_loop_cost_ratio"] = self.closed_loop_cost_ratio
        return table

    def remove_checkpoints(self) -> None:
        """Delete them: once results are written, a run need not go on."""
        for checkpoint in self.checkpoints.values():
            checkpoint.remove()
