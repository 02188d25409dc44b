"""What a search varies: lists, grids and random ranges of config fields."""

import itertools
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import require_count, require_number

MAX_TRIALS = 1_000_000  # of one search: each is built before the first runs
MAX_SEED = 2**63 - 1  # what a store can hold
KINDS = ("uniform", "log", "int")
_RANGE = re.compile(rf"({'|'.join(KINDS)})\s*\((.*)\)")
_FORMS = "[a, b, ..], uniform(low, high), log(low, high), int(low, high), or with a count: a grid"


@dataclass(frozen=True)
class Choices:
    """Every one of these values."""

    values: tuple[object, ...]

    def __post_init__(self) -> None:
        if not self.values:
            raise InvalidArgumentError("values", "at least one", "none")


@dataclass(frozen=True)
class Range:
    """Random values between low and high, both included.

    Attributes:
        low, high: low <= high; above 0 if log.
        kind: uniform, log (uniform in the logarithm), or int (uniform integers).
    """

    low: float
    high: float
    kind: str = "uniform"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InvalidArgumentError("kind", " or ".join(KINDS), self.kind)
        require_number("low", self.low, 0.0 if self.kind == "log" else -np.inf,
                       open_low=self.kind == "log")  # fmt: skip
        require_number("high", self.high, self.low)
        if self.kind == "int" and (self.low != int(self.low) or self.high != int(self.high)):
            raise InvalidArgumentError("int range", "integers", (self.low, self.high))

    def at(self, fraction: float) -> float | int:
        """The value at a fraction in [0, 1] of the range."""
        if self.kind == "int":
            low, high = int(self.low), int(self.high)
            return low + min(int(fraction * (high - low + 1)), high - low)
        if self.kind == "log":
            value = self.low * (self.high / self.low) ** fraction
        else:
            value = self.low + fraction * (self.high - self.low)
        return float(min(max(value, self.low), self.high))

    def grid(self, count: int) -> Choices:
        """`count` equally spaced values, ends included."""
        require_count("count of a grid", count, 1, MAX_TRIALS)
        if self.kind == "int":
            steps = np.linspace(self.low, self.high, count)
            return Choices(tuple(dict.fromkeys(round(float(x)) for x in steps)))
        return Choices(tuple(self.at(k / max(1, count - 1)) for k in range(count)))


Space = Mapping[str, Choices | Range]


def parse_dimension(text: str) -> tuple[str, Choices | Range]:
    """ "path=[..]" -> list; "path=log(1e-9, 1e-3)" -> range; "path=log(1e-9, 1e-3, 7)" -> grid.

    Raises:
        InvalidArgumentError: none of these.
    """
    path, sign, form = (part.strip() for part in text.partition("="))
    if not sign or not path:
        raise InvalidArgumentError("dimension", f"path={_FORMS}", repr(text))
    match = _RANGE.fullmatch(form)
    try:
        if match is None:
            values = json.loads(form)
            if not isinstance(values, list):
                raise TypeError
            return path, Choices(tuple(values))
        low, high, *count = json.loads(f"[{match[2]}]")
    except (ValueError, TypeError):
        raise InvalidArgumentError(path, _FORMS, repr(form)) from None
    found = Range(low, high, match[1])
    if len(count) > 1:
        raise InvalidArgumentError(path, _FORMS, repr(form))
    return path, found.grid(count[0]) if count else found


def expand(space: Space, draws: int, seed: int) -> list[dict[str, object]]:
    """All combinations of the lists and grids, `draws` times each where there are ranges.

    Draw k of a range is the same for any larger number of draws, and for every combination
    of the rest; without a range there is one draw.

    Raises:
        InvalidArgumentError: draws below 1, or more than MAX_TRIALS settings.
    """
    require_count("draws", draws, 1, MAX_TRIALS)
    ranges = {path: part for path, part in space.items() if isinstance(part, Range)}
    lists = {path: part.values for path, part in space.items() if isinstance(part, Choices)}
    total = math.prod(map(len, lists.values())) * (draws if ranges else 1)
    if total > MAX_TRIALS:
        raise InvalidArgumentError("vary", f"at most {MAX_TRIALS} settings", total)
    drawn = _draw(ranges, draws if ranges else 1, seed)
    return [
        {path: {**dict(zip(lists, values, strict=True)), **random}[path] for path in space}
        for values in itertools.product(*lists.values())
        for random in drawn
    ]


def _draw(ranges: Mapping[str, Range], draws: int, seed: int) -> Sequence[dict[str, object]]:
    fractions = stream(seed, "search_space").random((draws, len(ranges)))
    return [
        {path: part.at(float(u)) for (path, part), u in zip(ranges.items(), row, strict=True)}
        for row in fractions
    ]
