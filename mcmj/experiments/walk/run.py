"""A quadruped driven by its own compliant network: gaits, switches, pushes, and the way back.

Independent walks run side by side on threads; nothing depends on how many.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mcmj.experiments.walk.adapt import adapt
from mcmj.experiments.walk.config import Config, get_body
from mcmj.experiments.walk.lesson import Table, WalkLesson, each, learn, states_at, walk_table
from mcmj.experiments.walk.recover import recover
from mcmj.robots import walk_metrics
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import INTEGRATOR
from mcmj.robots.walker import Walker
from mcmj.simulation.simulation import Simulation
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.timing import interleaved_seconds, median_ratio

COST_STEPS = 4000
COST_REPEATS = 7


@dataclass(frozen=True)
class Result:
    """Walks by gait (one copy each), and the metrics of every part."""

    config: Config
    lesson: WalkLesson
    walks: dict[str, Walk]
    metrics: Table


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach the legs' lift, then run the parts that the config asks for.

    Raises:
        DivergenceError: a walk blew up.
        InvalidArgumentError, UnknownNameError: a body that cannot do it.
    """
    lesson = learn(config)
    walks: dict[str, Walk] = {}
    table: Table = {**lesson.fits}
    if "walk" in config.parts:
        walks = each(config.gaits, partial(walk_gait, lesson), on_steps)
        table |= {name: walk_table(lesson, name, walk) for name, walk in walks.items()}
    if "switch" in config.parts:
        falls = each(config.pairs, partial(switch, lesson), on_steps)
        table["switch"] = {
            f"{first}_to_{second}": {"falls": len(at), "of": config.moments, "falls_at": at}
            for (first, second), at in falls.items()
        }
    if "push" in config.parts:
        table["push"] = push_table(config, each(config.gaits, partial(push, lesson), on_steps))
    if "adapt" in config.parts:
        table["adapt"] = each(config.gaits, partial(adapt, lesson), on_steps)
    if "recover" in config.parts:
        table["recover"] = each(config.gaits, partial(recover, lesson), on_steps)
    if "steps" in config.parts:
        table["steps"] = each(config.gaits, partial(step_study, lesson), on_steps)
    if "cost" in config.parts:
        table["cost"] = step_cost(lesson)
    return Result(config, lesson, walks, table)


def walk_gait(
    lesson: WalkLesson, name: str, on_steps: OnSteps = lambda steps: None, **options: float
) -> Walk:
    """A walk in one gait, the first `settle` seconds included; options are the robot's."""
    walker = lesson.walker(**options)
    walker.start(lesson.gaits[name])
    duration = lesson.config.settle + lesson.config.walking
    walk = walker.walk(duration)
    on_steps(round(duration / walker.timestep))
    return walk


def tour(lesson: WalkLesson) -> tuple[Walker, Walk, list[tuple[float, str]]]:
    """One walk through all gaits and back to the first, for a film; with the times of switches."""
    config = lesson.config
    order = [*config.gaits, config.gaits[0]]
    walker = lesson.walker()
    walker.start(lesson.gaits[order[0]])
    parts, events = [], []
    for index, name in enumerate(order):
        walker.set_readout(lesson.gaits[name].w_out)
        parts.append(walker.walk(config.before, sample=0.01, joints=True))
        events.append((index * config.before, name))
    return walker, walk_metrics.joined(parts), events


def switch(
    lesson: WalkLesson, pair: tuple[str, str], on_steps: OnSteps = lambda steps: None
) -> list[float]:
    """At which moments of the stride, in strides, a switch from one gait to another ends in a fall.

    Moments are counted from the one that is `before` seconds after the start.
    """
    config, (first, second) = lesson.config, pair
    moments = np.arange(config.moments) / config.moments
    walker = lesson.walker(copies=config.moments)
    walker.start(lesson.gaits[first])
    walker.restore(states_at(lesson, lesson.gaits[first], moments * lesson.period(first)))
    walker.set_readout(lesson.gaits[second].w_out)
    walk = walker.walk(config.after, sample=0.02)
    on_steps(round((config.before + config.moments * config.after) / walker.timestep))
    found: list[float] = moments[
        np.isfinite(walk_metrics.fall_times(walk, config.robot.leg))
    ].tolist()
    return found


def push(lesson: WalkLesson, name: str, on_steps: OnSteps = lambda steps: None) -> dict[float, int]:
    """How many of `seeds` pushes of each size a gait survives, at random moments and directions."""
    config, gait = lesson.config, lesson.gaits[name]
    waits = stream(config.seed, "walk_moments").uniform(0.0, 2.0, config.seeds)
    angle = stream(config.seed, "walk_pushes").uniform(0.0, 2 * np.pi, config.seeds)
    states = states_at(lesson, gait, np.sort(waits) * lesson.period(name))
    walker = lesson.walker(copies=config.seeds)
    walker.start(gait)
    survived = {}
    for impulse in sorted(config.impulses):
        walker.restore(states)
        shove = impulse * np.column_stack([np.cos(angle), np.sin(angle)])
        walk = walker.walk(config.survive, push=shove, sample=0.02)
        fallen = np.isfinite(walk_metrics.fall_times(walk, config.robot.leg))
        survived[impulse] = int(config.seeds - fallen.sum())
        on_steps(round(config.seeds * config.survive / walker.timestep))
    return survived


def push_table(config: Config, survived: Mapping[str, Mapping[float, int]]) -> Table:
    """Counts by gait and impulse; the largest impulse up to which nothing fell."""

    def largest(counts: Mapping[float, int]) -> float:
        good = 0.0
        for impulse, count in counts.items():
            if count < config.seeds:
                break
            good = impulse
        return good

    table: Table = {
        name: {
            "survived": {f"{impulse:g}": count for impulse, count in counts.items()},
            "max_survived_Ns": largest(counts),
        }
        for name, counts in survived.items()
    }
    table["of"] = config.seeds
    table["max_survived_Ns"] = min(largest(counts) for counts in survived.values())
    return table


def step_study(lesson: WalkLesson, name: str, on_steps: OnSteps = lambda steps: None) -> Table:
    """Statistics of the same walk at other time steps [ms of the body as it was taught]."""
    pace = lesson.config.pace
    return {
        f"{step:g}": walk_table(
            lesson, name, walk_gait(lesson, name, on_steps, timestep=step * 1e-3 / pace)
        )
        for step in lesson.config.steps_ms
    }


def step_cost(lesson: WalkLesson) -> Table:
    """Time of a step of the whole scene over that of the planar body alone, in turns."""
    name = lesson.config.gaits[0]
    walker = lesson.walker()
    walker.start(lesson.gaits[name])
    planar = Simulation(lesson.body, w_out=get_body(lesson.config)[1][name], integrator=INTEGRATOR)
    works = {
        "scene": lambda: walker.rollout(COST_STEPS, record=()),
        "planar": lambda: planar.rollout(COST_STEPS, record=()),
    }
    seconds = interleaved_seconds(works, COST_REPEATS)
    return {
        "scene_us_per_step": 1e6 * float(np.median(seconds["scene"])) / COST_STEPS,
        "planar_us_per_step": 1e6 * float(np.median(seconds["planar"])) / COST_STEPS,
        "ratio": median_ratio(seconds, "scene", "planar"),
    }
