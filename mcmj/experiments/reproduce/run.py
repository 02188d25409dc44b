"""The paper, reproduced: every command that is not finished is run, then every claim is judged."""

import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from mcmj.experiments.reproduce.claims import Command, Outcome, Part, chosen, judge
from mcmj.experiments.reproduce.paper import PARTS
from mcmj.experiments.reproduce.runner import (
    Cost,
    Process,
    cost_of,
    execute,
    finished,
    metrics_of,
    options_of,
)
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import require_count

Run = tuple[Command, tuple[str, ...]]  # with its options
ALIASES = {"fig9": "fig8", "fig11": "fig10"}


@dataclass(frozen=True)
class Config:
    """What to reproduce.

    Attributes:
        quick: fewer bodies, committed ones where there are, no long runs.
        only: parts, such as fig6; default: all. fig9 is in fig8, fig11 in fig10.
        workers: commands that run at once; default: one a core.
    """

    quick: bool = False
    only: tuple[str, ...] = ()
    workers: int | None = None

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_count("workers", self.workers, 1)

    @property
    def parts(self) -> list[Part]:
        """The parts of the paper that are asked for."""
        return chosen(PARTS, [ALIASES.get(name, name) for name in self.only])

    def runs(self, part: Part) -> list[Run]:
        """The runs of a part in this mode, with their options."""
        pairs = [(run, options_of(run, quick=self.quick)) for run in part.runs]
        return [(run, options) for run, options in pairs if options is not None]


@dataclass(frozen=True)
class Result:
    """Outcomes of the claims by part, and the messages of what failed.

    Attributes:
        costs: of the commands that are finished, by name.
        minutes: that all of it took; None if some was finished before.
    """

    config: Config
    outcomes: dict[str, list[Outcome]]
    failures: list[str]
    costs: dict[str, Cost]
    minutes: float | None

    @property
    def metrics(self) -> Mapping[str, object]:
        """How many claims hold, and each in numbers."""
        table = {name: [outcome.plain for outcome in some] for name, some in self.outcomes.items()}
        flat = [outcome.holds for some in self.outcomes.values() for outcome in some]
        return {
            "held": sum(flat),
            "claims": len(flat),
            "parts": table,
            "reproduction_minutes": self.minutes,
            "costs": self.costs,
        }


def total_runs(config: Config) -> int:
    """Number of commands, for progress bars."""
    return sum(len(config.runs(part)) for part in config.parts)


def run(config: Config, *, folder: Path, on_steps: OnSteps = lambda steps: None) -> Result:
    """Run what is not finished in the folder, and judge the claims of what is."""
    begin = time.perf_counter()
    runs = [pair for part in config.parts for pair in config.runs(part)]
    missing = [pair for pair in runs if not finished(*pair, folder)]
    on_steps(len(runs) - len(missing))
    beside = [pair for pair in missing if not pair[0].alone]
    failures = _execute(beside, folder, config.workers or os.cpu_count() or 1, on_steps)
    failures += _execute([pair for pair in missing if pair[0].alone], folder, 1, on_steps)
    minutes = (time.perf_counter() - begin) / 60 if len(missing) == len(runs) else None
    outcomes = {p.name: _outcomes(config, p, folder) for p in config.parts}
    ends = {one.name: cost_of(one, folder) for one, o in runs if finished(one, o, folder)}
    costs = {name: cost for name, cost in ends.items() if cost is not None}
    return Result(config, outcomes, failures, costs, minutes)


def _execute(pairs: Sequence[Run], folder: Path, workers: int, on_steps: OnSteps) -> list[str]:
    """Run commands, so many at once; the messages of those that failed."""
    failures: list[str] = []
    started: list[Process] = []
    with ThreadPoolExecutor(workers) as pool:
        futures = [
            pool.submit(execute, one, options, folder, on_start=started.append)
            for one, options in pairs
        ]
        try:
            for future in as_completed(futures):
                try:
                    future.result()
                except McmjError as error:
                    failures.append(str(error))
                on_steps(1)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in started:
                process.terminate()
            raise
    return failures


def _outcomes(config: Config, part: Part, folder: Path) -> list[Outcome]:
    found = {
        one.name: metrics_of(one, folder)
        for one, options in config.runs(part)
        if finished(one, options, folder)
    }
    return [judge(claim, found[claim.run]) for claim in part.claims if claim.run in found]
