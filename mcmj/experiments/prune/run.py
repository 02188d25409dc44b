"""Which springs must be sensed? Readouts of fewer and fewer springs, run in closed loop."""

import numpy as np

from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.experiments.prune.config import Config
from mcmj.experiments.prune.result import Pruned, Result
from mcmj.learning.held_out import closed_loop_errors, held_out_starts
from mcmj.learning.spring_selection import importance, sense_only
from mcmj.learning.teaching import Course, lessons_of
from mcmj.simulation.simulation import Simulation
from mcmj.targets.named import named_target
from mcmj.utils.progress import OnSteps


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body once, then run readouts of its most important springs alone.

    Raises:
        DivergenceError: a body blew up under the teacher.
        BodyFileError, InvalidArgumentError: a body that cannot do the task.
    """
    return Result(
        config, [_of_body(config.of_seed(k), config, on_steps) for k in range(config.seeds)]
    )


def _of_body(one: limit_cycle.Config, config: Config, on_steps: OnSteps) -> Pruned:
    body, _, _, stepping = limit_cycle.get_body(one)
    wanted, teaching = named_target(config.task), config.teaching
    limit_cycle.check_task(one, body, wanted)
    simulation = Simulation(body, **stepping)
    course = Course(simulation, teaching, one.noise_seed)
    course.attend_all(lessons_of(wanted, teaching))
    regression = course.regression
    ridge = teaching.ridge_per_row * regression.weight
    starts = held_out_starts(simulation, wanted, teaching, one.noise_seed, config.starts)

    def error(springs: np.ndarray) -> float:
        readout = sense_only(regression, springs, ridge)
        on_steps(1)
        return float(
            closed_loop_errors(
                simulation, readout, starts, wanted, free_run=config.free_run, window=config.window
            ).max()
        )

    orders = {m: importance(regression, ridge, m, one.noise_seed) for m in config.methods}
    errors = {m: np.array([error(o[:n]) for n in config.counts]) for m, o in orders.items()}
    return Pruned(body, orders, errors, error(np.arange(body.n_springs)))
