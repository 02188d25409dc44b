"""What all parts of the walking experiment share: the taught body, robots, the table of a walk."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.walk.config import Config, get_body
from mcmj.robots import walk_metrics
from mcmj.robots.ground_training import teach_on_ground
from mcmj.robots.leg_readouts import LegReadout, teach_lift
from mcmj.robots.quadruped import GRAVITY, STRIDES
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walker import Walker
from mcmj.targets.gaits import gait_target
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads
from mcmj.utils.validation import Array

Table = dict[str, object]
K = TypeVar("K")
V = TypeVar("V")


@dataclass(frozen=True)
class WalkLesson:
    """What all parts of the experiment start from: the body and its gaits.

    Attributes:
        gaits: taught without ground.
        grounded: taught with the legs' loads in the body, if a part needs them.
    """

    config: Config
    body: Body
    gaits: dict[str, LegReadout]
    grounded: dict[str, LegReadout] = field(default_factory=dict)

    def walker(self, **options: Any) -> Walker:
        """A new robot with the config's settings."""
        config = self.config
        given = {"timestep": config.timestep / config.pace, "pace": config.pace}
        return Walker(self.body, config.robot, **{**given, **options})

    def period(self, gait: str) -> float:
        """Of a gait at the robot's pace [s]."""
        return gait_target(gait).period / self.config.pace

    @property
    def couplings(self) -> dict[str, float]:
        """Without and with the legs' loads in the body."""
        return {"uncoupled": 0.0, "coupled": self.config.coupling}

    @property
    def fits(self) -> Table:
        """Errors of all readouts on what they were fitted to, for metrics.json."""
        taught = {"lift_nrmse": self.gaits, "ground_nrmse": self.grounded}
        return {
            error: {name: gait.nrmse for name, gait in gaits.items()}
            for error, gaits in taught.items()
            if gaits
        }

    def gait(self, name: str, coupling: float) -> LegReadout:
        """The readouts for a body with that coupling."""
        return self.grounded[name] if coupling else self.gaits[name]


def learn(config: Config) -> WalkLesson:
    """Take the config's body and gaits, teach it how far the legs are lifted, and the ground."""
    body, readouts = get_body(config)

    def lift(name: str, on_steps: OnSteps) -> LegReadout:
        given: dict[str, Any] = {"stride": STRIDES.get(name), "pace": config.pace}
        return teach_lift(body, readouts[name], gait_target(name), engine="twin", **given)

    def ground(name: str, on_steps: OnSteps) -> LegReadout:
        walker = lesson.walker(coupling=config.coupling)
        return teach_on_ground(walker, lesson.gaits[name], gait_target(name), config.seed)

    lesson = WalkLesson(config, body, each(config.gaits, lift))
    if not {"adapt", "recover"} & set(config.parts):
        return lesson
    return replace(lesson, grounded=each(config.gaits, ground))


def each(
    items: Sequence[K],
    work: Callable[[K, OnSteps], V],
    on_steps: OnSteps = lambda steps: None,
) -> dict[K, V]:
    """Results of independent work by item."""
    return dict(zip(items, in_threads(work, items, on_steps), strict=True))


def walk_table(lesson: WalkLesson, name: str, walk: Walk) -> Table:
    """How a walk (its first copy) went after the first `settle` seconds."""
    config = lesson.config
    fallen = np.isfinite(walk_metrics.fall_times(walk, config.robot.leg)[0])
    settled = walk.after(config.settle)
    weight = GRAVITY * config.robot.mass
    measured = {
        "distance_m": walk_metrics.distances(settled)[0],
        "speed_m_s": walk_metrics.speeds(settled)[0],
        "cost_of_transport": walk_metrics.costs_of_transport(settled, weight)[0],
        "duty_factors": (settled.contact[0] > 0).mean(axis=0),
        "turn_deg_per_s": np.degrees(walk_metrics.turns(settled)[0]) / config.walking,
    }
    if fallen:
        measured = dict.fromkeys(measured, None)
    period = walk_metrics.stride_period(settled, lesson.period(name))
    return {"falls": int(fallen), **measured, "stride_period_s": period}


def walker_at(
    lesson: WalkLesson, gait: LegReadout, waits: Array, coupling: float = 0.0
) -> Iterator[Walker]:
    """A robot after `before` seconds and ascending waits [s] more, one after the other."""
    walker = lesson.walker(coupling=coupling)
    walker.start(gait)
    for wait in waits:
        until = round((lesson.config.before + wait) / walker.timestep)
        steps = until - round(walker.time / walker.timestep)
        if steps > 0:
            walker.rollout(steps, record=())
        yield walker


def states_at(lesson: WalkLesson, gait: LegReadout, waits: Array, coupling: float = 0.0) -> Array:
    """Snapshots (len(waits), n) of `walker_at`."""
    return np.vstack([walker.snapshot() for walker in walker_at(lesson, gait, waits, coupling)])
