"""A robot designed for its cost of transport: its muscles, its trunk's dampers, its stride.

    stiffness, dampers, swing, lift and pace times exp(x), the lag of the lift plus LAG x

By CMA-ES (mcmj.search.evolution). A robot is scored as it will be used: it learns the gait in one
round, and walks; what counts is the net cost of transport in closed loop, for what walks best
under the teacher is not what a readout holds.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.soft_robot.result import measures, walk_row
from mcmj.experiments.trunk.result import LearnedGait, Table, fell
from mcmj.experiments.trunk.run import learn, learn_on
from mcmj.robots.steering import straight_curvature
from mcmj.robots.trunk import draw_trunk, muscle_target
from mcmj.robots.trunk_walker import new_robot, walk
from mcmj.search.evolution import Evolution
from mcmj.targets.gaits import GAITS
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

SCALED = ("muscle_stiffness", "muscle_damping", "swing", "lift")
VARIED = (*SCALED, "trunk_dampers", "pace", "lag")
LAG = 0.1  # of a period, where the other parameters are factors exp(x)
SPREAD, BOUND = 0.15, 0.7  # of the first proposals, and of all
WALK = 10.0  # s, of a robot on trial; the second half is measured
ROBOTS = 3  # that walk as they are drawn and as designed: the first, and two that are new to it
SLOWEST, WORST = 0.3, 0.2  # m/s, orbit error: of a walk that counts


def economy(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """Design for one gait with the first robot, then robots of the next seeds as it was designed.

    Raises:
        MissingExtraError: cmaes is not installed.
    """
    evolution = Evolution(len(VARIED), config.seed, spread=SPREAD, bound=BOUND)
    curvature = straight_curvature(gaits[name].trunk, name, config.pace)
    best, least = np.zeros(len(VARIED)), _cost(config, name, curvature, on_steps)
    costs = [least]
    while len(costs) < config.designs:
        candidates = evolution.ask()
        scores = [_cost(designed(config, name, x), name, curvature, on_steps) for x in candidates]
        evolution.tell(candidates, scores)
        costs += scores
        if min(scores) < least:
            best, least = candidates[int(np.argmin(scores))], min(scores)
    other = designed(config, name, best)
    seeds = range(config.seed, config.seed + ROBOTS)
    others = [learn(config, (seed, name), on_steps) for seed in seeds[1:]]
    return {
        "tried": len(costs),
        "costs": costs,
        "drawn": [walk_row(config, gait) for gait in (gaits[name], *others)],
        "designed": [walk_row(other, learn(other, (seed, name), on_steps)) for seed in seeds],
        "settings": _numbers(other, name),
    }


def designed(config: Config, name: str, x: Array) -> Config:
    """What robots are drawn from, and the pace, at x (7,); 0 is the config."""
    at = dict(zip(VARIED, x, strict=True))
    trunk, factors = config.trunk, {one: float(np.exp(value)) for one, value in at.items()}
    changed: dict[str, Any] = {one: factors[one] * getattr(trunk, one) for one in SCALED}
    for one in ("d1", "d3"):
        changed[one] = tuple(factors["trunk_dampers"] * np.array(getattr(trunk, one)))
    lags = np.array(trunk.lags)
    lags[list(GAITS).index(name)] += LAG * at["lag"]
    other = replace(trunk, **changed, lags=tuple(lags.tolist()))
    return replace(config, trunk=other, pace=config.pace * factors["pace"])


def _numbers(config: Config, name: str) -> Table:
    """What was varied."""
    trunk, lag = config.trunk, config.trunk.lags[list(GAITS).index(name)]
    values = (*(getattr(trunk, one) for one in SCALED), trunk.d1, config.pace, lag)
    return dict(zip(VARIED, values, strict=True))


def _cost(config: Config, name: str, curvature: float, on_steps: OnSteps) -> float:
    """Net cost of transport after a short course; infinite for a robot that does not walk."""
    config = replace(config, learning=replace(config.learning, rounds=1))
    trunk = draw_trunk(config.seed, config.trunk)
    target = muscle_target(trunk, name, config.pace, curvature=curvature)
    robot = new_robot(trunk)
    learned = learn_on(config, robot, trunk, target, config.seed, on_steps)
    walked = None if learned is None else or_lost(lambda: walk(robot, trunk, WALK), None)
    on_steps(round(WALK / robot.timestep))
    gait = LearnedGait(trunk, target, learned, walked)
    if walked is None or fell(gait, walked):
        return np.inf
    found: dict[str, Any] = measures(gait, walked.after(WALK / 2))
    walks = found["speed_m_s"] > SLOWEST and found["orbit_error"] < WORST
    return float(found["cost_of_transport"]) if walks else np.inf
