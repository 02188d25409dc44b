"""A body that blows up is stepped more finely, or is a failure among others."""

from dataclasses import replace

import numpy as np
import pytest

from mcmj.core.random_body import BodySettings
from mcmj.experiments.blow_ups import finer, with_finer_steps
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.experiments.perturb import run as perturb
from mcmj.experiments.swing_up import run as swing_up
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.utils.errors import DivergenceError

pytestmark = pytest.mark.filterwarnings("ignore::mcmj.utils.errors.StabilityWarning")

# damping rates of hundreds a second: the leapfrog bears 2 over the largest of them
STIFF = {
    "task": "quadratic",
    "seeds": 2,
    "timestep": 8e-3,
    "settings": BodySettings(nodes=8, d1=(40.0, 60.0)),
    "teaching": Teaching(duration=30.0, washout=10.0),
    "practice": Practice(rounds=0, trial=20.0, trial_window=12.0),
    "engine": "twin",
}


def test_the_step_is_halved_until_it_holds():
    config = limit_cycle.Config(**STIFF, free_run=20.0, windows=0.0, measure_cost=False)
    result = limit_cycle.run(replace(config, seeds=1, seed=0))
    step = result.stepping["timestep"]
    assert step in (4e-3, 2e-3)
    assert result.metrics["timestep"] == step
    assert np.diff(result.tasks["quadratic"].times) == pytest.approx(step)
    with pytest.raises(DivergenceError):
        limit_cycle.run(replace(config, seeds=1, seed=0, timestep=8 * step))


@pytest.mark.parametrize("module", [perturb, swing_up])
def test_what_blows_up_with_every_step_is_a_failure_among_others(module):
    held = module.run(module.Config(**STIFF)).metrics
    lost = module.run(module.Config(**STIFF | {"timestep": 64e-3})).metrics
    if module is perturb:
        held, lost = held["seeds"]["unperturbed"], lost["seeds"]["unperturbed"]
    else:
        held, lost = held["seeds"]["quadratic"], lost["seeds"]["quadratic"]
        assert np.isfinite(held["orbit_errors"][0])
        assert lost["orbit_errors"] == [np.inf, np.inf]
    assert (lost["successes"], lost["of"]) == (0, 2)
    assert held["of"] == 2


def test_finer_steps_are_a_half_and_a_quarter_and_errors_are_passed_on():
    config, tried = limit_cycle.Config(), []

    def work(one):
        tried.append(one.timestep)
        raise DivergenceError("gone", time=1.0, steps_done=1)

    with pytest.raises(DivergenceError):
        with_finer_steps(work, config)
    assert tried == [1e-3, 5e-4, 2.5e-4] == [one.timestep for one in finer(config)]
    assert with_finer_steps(lambda one: one.timestep, config) == 1e-3
