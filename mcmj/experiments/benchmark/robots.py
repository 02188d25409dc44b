"""What a step of the soft robot costs, in space, beside the robot in a plane."""

from functools import partial

import numpy as np

from mcmj.experiments.benchmark.config import Config
from mcmj.experiments.soft_robot.config import SPATIAL
from mcmj.robots.trunk import TrunkSettings, draw_trunk
from mcmj.robots.trunk_walker import STEPS, new_robot, stand
from mcmj.utils.timing import Work, interleaved_seconds, median_ratio

INTEGRATORS = dict([STEPS[3]], discrete=1e-3, implicitfast=1e-3)  # time steps [s]


def robot_costs(config: Config, body: object) -> dict[str, object]:
    """Closed loop, standing on its feet, over the planar robot: of a step, of a simulated second.

    The planar robot steps by `discrete` at 1 ms, the soft robot by Euler at 0.4 ms if not asked
    otherwise. Nothing is recorded; the readout is 0.
    """
    flat, spatial = draw_trunk(config.seed, TrunkSettings()), draw_trunk(config.seed, SPATIAL)
    robots = {"planar": new_robot(flat)}
    for name, step in INTEGRATORS.items():
        robots[name] = new_robot(spatial, timestep=step, integrator=name)
    works: dict[str, Work] = {}
    for name, robot in robots.items():
        robot.set_readout(np.zeros((robot.n_signals, robot.n_outputs)))
        stand(robot)
        works[name] = partial(robot.rollout, max(10, config.steps // 4), record=())
    seconds = interleaved_seconds(works, config.repeats)
    per_step = {name: median_ratio(seconds, name, "planar") for name in INTEGRATORS}
    planar = robots["planar"].timestep
    return {
        "soft_robot_step_ratio": per_step,
        "soft_robot_second_ratio": {
            name: ratio * planar / INTEGRATORS[name] for name, ratio in per_step.items()
        },
    }
