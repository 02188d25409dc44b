"""Absurd arguments are refused at once, by one line that names what the user gave."""

import time

import pytest

from mcmj.errors import McmjError
from mcmj.experiments import (
    gaits_config,
    guided,
    input_driven_config,
    limit_cycle_config,
    linearise,
    search,
    walk_config,
)
from mcmj.generator import BodySettings, random_body
from mcmj.lessons import Teaching
from mcmj.simulation import Simulation

LIMIT_CYCLE = limit_cycle_config.Config
TIMED = (gaits_config, input_driven_config, limit_cycle_config, linearise, walk_config)
CASES = [
    ("body", lambda: limit_cycle_config.get_body(LIMIT_CYCLE(body=""))),
    ("body", lambda: gaits_config.get_body(gaits_config.Config(body=""), 0)),
    ("body", lambda: Simulation(None)),
    ("windows", lambda: LIMIT_CYCLE(windows=0.1)),
    *[("timestep", lambda m=module: m.Config(timestep=1e-320)) for module in TIMED],
    ("timestep", lambda: Simulation(random_body(0), timestep=1e-320)),
    ("every", lambda: Teaching(every=1_000_000)),
    ("nodes", lambda: BodySettings(nodes=10**8)),
    ("n_outputs", lambda: BodySettings(n_outputs=10**8)),
    ("count of a grid", lambda: search.Config(vary=("teaching.noise=log(0.1,1,1000000000)",))),
    ("vary", lambda: search.Config(vary=("seed=int(1,2000,2000)", "window=int(1,2000,2000)"))),
    ("draws", lambda: search.Config(draws=10**9)),
    ("seeds", lambda: search.Config(seeds=10**9)),
    ("first_seed", lambda: search.Config(first_seed=10**30)),
    ("experiment", lambda: search.Config(experiment="../x")),
    ("bodies", lambda: guided.Config(bodies=10**9)),
    ("hook", lambda: Simulation(random_body(0)).rollout(1, hook=3)),
    ("hook's forces", lambda: Simulation(random_body(0)).rollout(1, hook=lambda t, x: [1.0])),
]


@pytest.mark.parametrize(("name", "make"), CASES)
def test_absurd_values_are_refused_at_once(name, make):
    began = time.monotonic()
    with pytest.raises(McmjError) as caught:
        make()
    assert time.monotonic() - began < 5.0
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)
