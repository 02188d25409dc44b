"""What the paper claims, which command shows it, and when it holds.

Figures and sections are those of Hauser et al., Biol. Cybern. 106 (2012) 595-613. The paper shows
single bodies and gives few numbers; where it gives none, its claim stands in words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.metrics.metric_paths import numbers_at
from mcmj.metrics.success_rates import success_rate
from mcmj.utils.errors import UnknownNameError

FEW = 10  # bodies, below which a rate is neither shown nor refuted
FORMATS = {"error": "{:.2%}", "time": "{:.1f} s", "ratio": "{:.3f}"}


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes:
        name: of its folder.
        script: in scripts/, without suffix.
        full, quick: its options; None: not run in that mode.
        alone: it measures times: no other command runs beside it.
    """

    name: str
    script: str
    full: tuple[str, ...]
    quick: tuple[str, ...] | None
    alone: bool = False


@dataclass(frozen=True)
class Claim:
    """A claim and the numbers that decide it.

    Attributes:
        text: what is claimed.
        paper: the paper's value, or its words.
        run: name of the run whose metrics hold ours.
        paths: into them, see metric_paths; all numbers that they lead to are taken together.
        kind: of number, one of FORMATS.
        limit: a value at or below it is a success; None counts as a failure.
        needed: the claim holds unless the successes refute this rate: unless the upper end of
            their 95 % Wilson interval is below it; 1: all must succeed.
    """

    text: str
    paper: str
    run: str
    paths: tuple[str, ...]
    kind: str = "error"
    limit: float = 0.05
    needed: float = 0.9


@dataclass(frozen=True)
class Part:
    """A figure of the paper, or a section."""

    name: str
    title: str
    runs: tuple[Command, ...]
    claims: tuple[Claim, ...]


@dataclass(frozen=True)
class Outcome:
    """A claim with what came out.

    Attributes:
        values: our values, infinite where there is none.
        rate: counts of successes, see mcmj.metrics.success_rates.
        holds: whether enough of them are successes.
    """

    claim: Claim
    values: tuple[float, ...]
    rate: dict[str, Any]
    holds: bool

    @property
    def ours(self) -> str:
        """Median and range, for people."""
        show = FORMATS[self.claim.kind].format
        texts = [show(v) if np.isfinite(v) else "never" for v in sorted(self.values)]
        if len(texts) == 1:
            return texts[0]
        median = float(np.median(self.values))
        middle = show(median) if np.isfinite(median) else "never"
        return f"{middle} ({texts[0]} to {texts[-1]})"

    @property
    def decided(self) -> bool:
        """Whether there are bodies enough for a rate, or only one was claimed."""
        few = 1 < self.rate["of"] < FEW
        return self.claim.needed == 1.0 or not few

    @property
    def verdict(self) -> str:
        """yes or no; of a few bodies only how many."""
        if not self.decided:
            return f"{self.rate['successes']} of {self.rate['of']}"
        return "yes" if self.holds else "no"

    @property
    def plain(self) -> dict[str, object]:
        """As written to metrics.json."""
        finite = [v if np.isfinite(v) else None for v in self.values]
        return {
            "claim": self.claim.text,
            "paper": self.claim.paper,
            "values": finite,
            "median": float(np.median(self.values)),
            "success": self.rate,
            "limit": self.claim.limit,
            "holds": self.holds,
            "verdict": self.verdict,
        }


def judge(claim: Claim, metrics: Mapping[str, object]) -> Outcome:
    """Look up a claim's numbers in a run's metrics and count the successes.

    Raises:
        UnknownNameError: the metrics have no such number.
    """
    found = [x for path in claim.paths for x in numbers_at(metrics, path).values()]
    values = tuple(np.inf if x is None else x for x in found)
    good = [value <= claim.limit for value in values]
    rate: dict[str, Any] = success_rate(good)
    holds = all(good) if claim.needed == 1.0 else rate["interval_95"][1] >= claim.needed
    return Outcome(claim, values, rate, holds)


def chosen(parts: Sequence[Part], only: Sequence[str]) -> list[Part]:
    """The parts with these names; all without any.

    Raises:
        UnknownNameError: no such part.
    """
    names = [part.name for part in parts]
    for name in only:
        if name not in names:
            raise UnknownNameError("part", name, names)
    return [part for part in parts if not only or part.name in only]
