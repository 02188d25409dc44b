"""The paper, reproduced: every command that is not finished is run, then every claim is judged."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mcmj.experiments.reproduce.claims import Command, Outcome, Part, chosen, judge
from mcmj.experiments.reproduce.paper import PARTS
from mcmj.experiments.reproduce.runner import execute, finished, metrics_of, options_of
from mcmj.utils.errors import McmjError
from mcmj.utils.progress import OnSteps

ALIASES = {"fig9": "fig8", "fig11": "fig10"}


@dataclass(frozen=True)
class Config:
    """What to reproduce.

    Attributes:
        quick: fewer bodies, committed ones where there are, no long runs.
        only: parts, such as fig6; default: all. fig9 is in fig8, fig11 in fig10.
    """

    quick: bool = False
    only: tuple[str, ...] = ()

    @property
    def parts(self) -> list[Part]:
        """The parts of the paper that are asked for."""
        return chosen(PARTS, [ALIASES.get(name, name) for name in self.only])

    def runs(self, part: Part) -> list[tuple[Command, tuple[str, ...]]]:
        """The runs of a part in this mode, with their options."""
        pairs = [(run, options_of(run, quick=self.quick)) for run in part.runs]
        return [(run, options) for run, options in pairs if options is not None]


@dataclass(frozen=True)
class Result:
    """Outcomes of the claims by part, and the messages of what failed."""

    config: Config
    outcomes: dict[str, list[Outcome]]
    failures: list[str]

    @property
    def metrics(self) -> Mapping[str, object]:
        """How many claims hold, and each in numbers."""
        table = {name: [outcome.plain for outcome in some] for name, some in self.outcomes.items()}
        flat = [outcome.holds for some in self.outcomes.values() for outcome in some]
        return {"held": sum(flat), "claims": len(flat), "parts": table}


def total_runs(config: Config) -> int:
    """Number of commands, for progress bars."""
    return sum(len(config.runs(part)) for part in config.parts)


def run(config: Config, *, folder: Path, on_steps: OnSteps = lambda steps: None) -> Result:
    """Run what is not finished in the folder, and judge the claims of what is."""
    failures = []
    for part in config.parts:
        for one, options in config.runs(part):
            try:
                if not finished(one, options, folder):
                    execute(one, options, folder)
            except McmjError as error:
                failures.append(str(error))
            on_steps(1)
    return Result(config, {p.name: _outcomes(config, p, folder) for p in config.parts}, failures)


def _outcomes(config: Config, part: Part, folder: Path) -> list[Outcome]:
    found = {
        one.name: metrics_of(one, folder)
        for one, options in config.runs(part)
        if finished(one, options, folder)
    }
    return [judge(claim, found[claim.run]) for claim in part.claims if claim.run in found]
