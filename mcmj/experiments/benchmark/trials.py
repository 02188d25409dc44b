"""What a whole trial costs, as a search runs it, over its steps alone."""

import time
from collections.abc import Callable

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.benchmark.config import Config, small_readout
from mcmj.search.experiment import load_experiment, make_config
from mcmj.simulation.simulation import Simulation
from mcmj.utils.threads import one_blas_thread

ENOUGH = 2.0  # s of measuring, from which on there is no further round
TEACHING = {"teaching.duration": 80.0, "teaching.washout": 30.0}  # the paper's

CHANGES: dict[str, dict[str, object]] = {
    "limit_cycle": {"task": "quadratic", "free_run": 60.0, **TEACHING},
    "swing_up": {"task": "quadratic"},
}


def trial_costs(config: Config, body: Body) -> dict[str, object]:
    """Processor time of a trial on the twin over that of its steps, nothing recorded.

    A process's first trial, with what is computed once, is not counted.
    """
    with one_blas_thread():
        return {"trial_over_physics": {name: _over_physics(config, name) for name in config.trials}}


def _over_physics(config: Config, name: str) -> float:
    changes = {"engine": "twin", "seed": config.seed, **CHANGES.get(name, {})}
    trial = make_config(name, changes)
    run, counts = load_experiment(name).run, [0]

    def count(steps: int) -> None:
        counts[0] += steps

    own_body = run(trial, on_steps=count).body
    steps, begin = counts[0], time.process_time()
    ratios: list[float] = []
    simulation = Simulation(own_body, w_out=small_readout(own_body), engine="twin")
    while len(ratios) < config.repeats and (not ratios or time.process_time() - begin < ENOUGH):
        whole = _seconds(lambda: run(trial).metrics)
        simulation.reset()
        alone = _seconds(lambda: simulation.rollout(steps, record=()))
        ratios.append(whole / alone)
    return float(np.median(ratios))


def _seconds(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin
