"""What else is tried with the first robot, each part with one gait."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.soft_robot.controls import controls
from mcmj.experiments.soft_robot.economy import economy
from mcmj.experiments.soft_robot.result import measures
from mcmj.experiments.trunk import parts as trunk_parts
from mcmj.experiments.trunk.result import LearnedGait, Table, fell
from mcmj.experiments.trunk.run import learn_on
from mcmj.learning.free_run import trial_error
from mcmj.learning.lessons import Lesson, Teaching
from mcmj.learning.practice import Exercise, Practice, practise_exercises
from mcmj.learning.teaching import Course
from mcmj.metrics import orbits
from mcmj.robots.energy import energy_balance
from mcmj.robots.trunk_walker import has_fallen, heading_ahead, new_robot, stand, walk
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream

Gaits = dict[str, LearnedGait]


def by_practice(config: Config, gaits: Gaits, name: str, on_steps: OnSteps) -> Table:
    """Orbit error of a free run after practice (DAgger), infinite if the robot falls."""
    gait, learning = gaits[name], config.learning
    robot = new_robot(gait.trunk)
    stand(robot)
    start, washout = robot.snapshot(), learning.washout
    radius = orbits.rms_radius(gait.target.orbit(orbits.ORBIT_POINTS))
    teaching = Teaching(
        noise=learning.noise * radius / np.sqrt(gait.target.n_outputs),
        ridge_per_row=1e-9, bias=True, every=max(1, round(learning.period / robot.timestep)),
    )  # fmt: skip
    lesson = Lesson(gait.target.sample, config.teaching, washout, start=start)
    course = Course(robot, teaching, config.seed)
    practice = Practice(
        rounds=2 * learning.rounds, round_runs=1, round_weight=1.0, trial=learning.trial,
        trial_window=learning.trial / 2, good_enough=learning.good_enough,
    )  # fmt: skip
    exercise = Exercise(
        replace(lesson, duration=learning.round_duration, washout=0.0),
        lambda outputs: orbits.orbit_error(outputs, gait.target),
    )
    try:
        course.attend(lesson, on_steps=on_steps)
    except DivergenceError:
        return {"orbit_error": np.inf, "trial_errors": []}
    errors = practise_exercises(course, [exercise], practice, on_steps=on_steps).errors
    robot.restore(start)
    fallen = has_fallen(gait.trunk)
    error = trial_error(robot, gait.target, config.walking, fallen, on_steps=on_steps)
    return {"orbit_error": error, "trial_errors": list(errors)}


def energy(config: Config, gaits: Gaits, name: str, on_steps: OnSteps) -> Table:
    """The balance of some whole strides, over their duration: J in a second."""
    gait, robot = gaits[name], gaits[name].robot()
    period = gait.target.period
    steps = round(max(1, round(2.0 / period)) * period / robot.timestep)
    balance = energy_balance(robot, gait.trunk, steps)
    on_steps(steps)
    seconds = steps * robot.timestep
    return {
        "work_J": balance.work / seconds,
        "positive_work_J": balance.positive / seconds,
        "muscles_J": balance.muscles / seconds,
        "trunk_J": balance.trunk / seconds,
        "ground_J": balance.ground / seconds,
        "change_J": balance.change / seconds,
        "balance_error": balance.error,
    }


def ground(config: Config, gaits: Gaits, name: str, on_steps: OnSteps) -> Table:
    """Slopes, and steps up and down, that nobody taught."""
    gait = gaits[name]
    slopes = {f"slope {slope:g}": (float(np.arctan(slope)), 0.0) for slope in config.slopes}
    steps = {f"step {1e3 * step:g} mm": (0.0, step) for step in config.heights}
    start, table = heading_ahead(gait.trunk, gait.robot()), Table()
    for what, (slope, step) in (slopes | steps).items():
        assert gait.learned is not None
        robot = new_robot(gait.trunk, slope=slope, step=step)
        robot.set_readout(gait.learned.w_out)
        robot.set_state(*start)
        table[what] = _short(config, gait, robot)
        on_steps(round(config.judged / robot.timestep))
    return table


def cut(config: Config, gaits: Gaits, name: str, on_steps: OnSteps) -> Table:
    """A share of the springs is cut while it walks: as it was taught, and after learning again."""
    gait = gaits[name]
    count = round(config.cut * gait.trunk.n_sensed)
    chosen = stream(config.seed, "pruning_order").permutation(gait.trunk.n_sensed)[:count]
    names = [f"s{spring}" for spring in sorted(chosen.tolist())]
    assert gait.learned is not None
    robot, walking = new_robot(gait.trunk), gait.robot()
    robot.alter(cut=names)
    robot.set_readout(gait.learned.w_out)
    robot.set_state(walking.qpos, walking.qvel)
    before = _short(config, gait, robot)
    robot = new_robot(gait.trunk)
    robot.alter(cut=names)
    again = learn_on(config, robot, gait.trunk, gait.target, config.seed, on_steps)
    found = or_lost(lambda: walk(robot, gait.trunk, config.judged), None)
    if again is None or found is None or fell(gait, found):
        return {"cut": count, "before": before, "after": {"falls": 1}}
    last = found.after(config.judged / 2)
    return {"cut": count, "before": before, "after": {"falls": 0} | measures(gait, last)}


def _short(config: Config, gait: LearnedGait, robot: Reservoir) -> Table:
    """A walk as long as what is judged, its second half measured."""
    found = or_lost(lambda: walk(robot, gait.trunk, config.judged), None)
    if found is None or fell(gait, found):
        return {"falls": 1}
    return {"falls": 0} | measures(gait, found.after(config.judged / 2))


RUNS: dict[str, Callable[[Config, Gaits, str, OnSteps], object]] = {
    "regression": trunk_parts.by_regression,
    "practice": by_practice,
    "rest": trunk_parts.from_rest,
    "push": partial(trunk_parts.push, axis=1),
    "switch": trunk_parts.switch,
    "steps": trunk_parts.step_study,
    "energy": energy,
    "controls": controls,
    "ground": ground,
    "cut": cut,
    "economy": economy,
}
