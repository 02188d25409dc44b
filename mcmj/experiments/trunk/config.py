"""What the experiment of the walking trunk runs: its Config."""

from dataclasses import dataclass, field
from typing import ClassVar

from mcmj.learning.force_learning import ForceLearning
from mcmj.robots.recorded_walk import PUSH_DURATION
from mcmj.robots.trunk import TrunkSettings
from mcmj.robots.trunk_walker import STEPS
from mcmj.targets.gaits import GAITS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    require_count,
    require_duration,
    require_names,
    require_number,
    require_seed,
)

PARTS = ("regression", "rest", "push", "switch", "steps")


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        gaits: which.
        seed: of the robot, the first if there are several.
        seeds: number of robots that learn and walk; the parts are run with the first.
        parts: besides: regression: the same readouts by plain regression under a noisy teacher;
            rest: from standing still; push: count falls; switch: of the readout while walking;
            steps: the same walk at other time steps.
        pace: of the gaits, as many times faster than mcmj.targets.gaits.
        walking: a walk of each gait after learning [s] ..
        judged: .. whose last part is measured [s].
        teaching: what the regression learns from [s]; its noise and ridge are those of learning.
        pushes: moments of a stride at which the robot is pushed, forwards and backwards.
        impulses: sizes of the pushes [N s], for 0.1 s.
        survive: a push or switch is survived if the robot does not fall for so long [s].
        steps_ms: time steps of the part steps [ms].
        trunk: what robots are drawn from.
        learning: how they learn.
    """

    known_parts: ClassVar[tuple[str, ...]] = PARTS

    gaits: tuple[str, ...] = tuple(GAITS)
    seed: int = 0
    seeds: int = 1
    parts: tuple[str, ...] = PARTS
    pace: float = 11.0
    walking: float = 60.0
    judged: float = 20.0
    teaching: float = 60.0
    pushes: int = 4
    impulses: tuple[float, ...] = (5.0, 10.0, 20.0, 40.0)
    survive: float = 10.0
    steps_ms: tuple[float, ...] = (0.5, 1.0, 2.0)
    trunk: TrunkSettings = field(default_factory=TrunkSettings)
    learning: ForceLearning = field(default_factory=ForceLearning)

    def __post_init__(self) -> None:
        require_names("gait", self.gaits, GAITS)
        if self.parts:
            require_names("part", self.parts, self.known_parts)
        require_seed("seed", self.seed)
        for name in ("seeds", "pushes"):
            require_count(name, getattr(self, name), 1)
        require_number("pace", self.pace, 0.0, open_low=True)
        for name in ("teaching", "walking", "survive"):
            require_duration(name, getattr(self, name))
        require_number("judged", self.judged, 1.0)
        require_number("survive", self.survive, 1.0 + PUSH_DURATION)
        if self.walking <= self.judged:
            raise InvalidArgumentError("walking", f"more than {self.judged:g} s", self.walking)
        for name in ("impulses", "steps_ms"):
            if not getattr(self, name):
                raise InvalidArgumentError(name, "at least one", ())
            for value in getattr(self, name):
                require_number(name, value, 0.0, open_low=True)


def total_steps(config: Config) -> int:
    """Steps at most, for a progress bar."""
    return round(_seconds(config) / STEPS[3 if config.trunk.depth else 2][1])


def _seconds(config: Config) -> float:
    learning, gaits = config.learning, len(config.gaits)
    parts = {
        "regression": learning.washout + config.teaching + config.walking,
        "rest": config.walking,
        "push": len(config.impulses) * 2 * config.pushes * config.survive,
        "switch": (gaits - 1) * config.survive,
        "steps": len(config.steps_ms) * config.walking,
    }
    besides = sum(parts[part] for part in config.parts)
    return gaits * (config.seeds * (learning.total + config.walking) + besides)
