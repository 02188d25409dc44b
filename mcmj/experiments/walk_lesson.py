"""What all parts of the walking experiment share: the taught body, robots, the table of a walk."""

from dataclasses import dataclass

import numpy as np

from mcmj import walkmetrics
from mcmj.body import Body
from mcmj.experiments.walk_config import Config, get_body
from mcmj.gaits import gait_target
from mcmj.legs import LegReadout, teach_lift
from mcmj.progress import OnSteps
from mcmj.quadruped import GRAVITY, STRIDES
from mcmj.threads import in_threads
from mcmj.validation import Array
from mcmj.walker import Walker
from mcmj.walkmetrics import Walk

Table = dict[str, object]


@dataclass(frozen=True)
class Lesson:
    """What all parts of the experiment start from: the body and its gaits."""

    config: Config
    body: Body
    gaits: dict[str, LegReadout]
    lift_nrmse: dict[str, float]

    def walker(self, **options: object) -> Walker:
        """A new robot with the config's settings."""
        config = self.config
        given = {"timestep": config.timestep / config.pace, "pace": config.pace} | options
        return Walker(self.body, config.robot, **given)  # type: ignore[arg-type]

    def period(self, gait: str) -> float:
        """Of a gait at the robot's pace [s]."""
        return gait_target(gait).period / self.config.pace


def learn(config: Config) -> Lesson:
    """Take the config's body and gaits, and teach it how far the legs are lifted."""
    body, readouts = get_body(config)

    def teach(name: str, on_steps: OnSteps) -> tuple[LegReadout, float]:
        gait, fit = teach_lift(
            body, readouts[name], gait_target(name), stride=STRIDES.get(name), engine="twin"
        )
        return gait, fit.train_nrmse

    taught = in_threads(teach, config.gaits, lambda steps: None)
    gaits = {name: gait for name, (gait, _) in zip(config.gaits, taught, strict=True)}
    nrmse = {name: error for name, (_, error) in zip(config.gaits, taught, strict=True)}
    return Lesson(config, body, gaits, nrmse)


def walk_table(
    lesson: Lesson, name: str, walk: Walk, *, slope: float = 0.0, mass: float | None = None
) -> Table:
    """How a walk (its first copy) went after the first `settle` seconds."""
    config = lesson.config
    fallen = np.isfinite(walkmetrics.fall_times(walk, config.robot.leg, slope)[0])
    settled = walk.after(config.settle)
    weight = GRAVITY * (config.robot.mass if mass is None else mass)
    measured = {
        "distance_m": walkmetrics.distances(settled)[0],
        "speed_m_s": walkmetrics.speeds(settled)[0],
        "cost_of_transport": walkmetrics.costs_of_transport(settled, weight)[0],
        "duty_factors": (settled.contact[0] > 0).mean(axis=0),
        "turn_deg_per_s": np.degrees(walkmetrics.turns(settled)[0]) / config.walking,
    }
    if fallen:
        measured = dict.fromkeys(measured, None)
    period = walkmetrics.stride_period(settled, lesson.period(name))
    return {"falls": int(fallen), **measured, "stride_period_s": period}


def moments(lesson: Lesson, name: str, count: int, rng: np.random.Generator) -> Array:
    """States (count, n) at random moments of two strides of a settled walk."""
    walker = lesson.walker()
    walker.start(lesson.gaits[name])
    waits = np.sort(rng.uniform(0.0, 2 * lesson.period(name), count))
    states, previous = [], -lesson.config.before
    for wait in waits:
        steps = max(1, round((wait - previous) / walker.timestep))
        walker.advance(steps)
        states.append(walker.snapshot()[0])
        previous = wait
    return np.array(states)
