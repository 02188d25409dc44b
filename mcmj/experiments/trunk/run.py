"""A robot that is its own computer: does it learn to walk, and what does it take?

Robots and gaits are independent and run side by side on threads; nothing depends on how many.
"""

from functools import partial

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.trunk.config import Config
from mcmj.experiments.trunk.parts import RUNS, push_summary
from mcmj.experiments.trunk.result import LearnedGait, Result, Table, seeds_table, walk_table
from mcmj.learning.force_learning import Learned, force_learn
from mcmj.learning.free_run import trial_error
from mcmj.robots.steering import straight_curvature
from mcmj.robots.trunk import Trunk, draw_trunk, muscle_target
from mcmj.robots.trunk_walker import has_fallen, new_robot, stand, walk
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Let every robot learn every gait and walk, then run the parts with the first one.

    Raises:
        McmjError: a config that MuJoCo does not take.
    """
    robots = [
        (seed, name)
        for seed in range(config.seed, config.seed + config.seeds)
        for name in config.gaits
    ]
    walked = in_threads(partial(learn, config), robots, on_steps)
    found = dict(zip(robots, walked, strict=True))
    gaits = {name: found[config.seed, name] for name in config.gaits}
    table: Table = {name: walk_table(config, gait) for name, gait in gaits.items()}
    if config.seeds > 1:
        table["seeds"] = seeds_table(config, found)
    good = {name: gait for name, gait in gaits.items() if gait.learned is not None}
    for part in config.parts:
        rows = in_threads(partial(RUNS[part], config, good), tuple(good), on_steps)
        table[part] = dict(zip(good, rows, strict=True))
    if "push" in config.parts:
        table["push"] = push_summary(config, table["push"])  # type: ignore[arg-type]  # of RUNS
    return Result(config, gaits, table)


def learn(config: Config, chosen: tuple[int, str], on_steps: OnSteps) -> LearnedGait:
    """One robot, by its seed, learns one gait, by its name, and walks."""
    seed, name = chosen
    trunk = draw_trunk(seed, config.trunk)
    flat = trunk.body.dimensions == 2
    straight = 0.0 if flat else straight_curvature(trunk, name, config.pace)
    target = muscle_target(trunk, name, config.pace, curvature=straight)
    robot = new_robot(trunk)
    learned = learn_on(config, robot, trunk, target, seed, on_steps)
    walked = None if learned is None else or_lost(lambda: walk(robot, trunk, config.walking), None)
    on_steps(round(config.walking / robot.timestep))
    return LearnedGait(trunk, target, None if walked is None else learned, walked)


def learn_on(
    config: Config, robot: Reservoir, trunk: Trunk, target: Target, seed: int, on_steps: OnSteps
) -> Learned | None:
    """A robot learns; None if it blew up."""
    judge = partial(
        trial_error, robot, target, config.learning.trial, has_fallen(trunk), on_steps=on_steps
    )
    return or_lost(
        lambda: force_learn(
            robot, target, config.learning, seed=seed, stand=lambda: stand(robot),
            judge=judge, on_steps=on_steps,
        ),
        None,
    )  # fmt: skip
