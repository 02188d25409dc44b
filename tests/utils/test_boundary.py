"""Absurd arguments are refused at once, by one line that names what the user gave."""

import time

import pytest

from mcmj.core.random_body import BodySettings, random_body
from mcmj.experiments.benchmark import config as benchmark_config  # fmt: skip
from mcmj.experiments.capacity import run as capacity
from mcmj.experiments.certify import config as certify_config
from mcmj.experiments.drive import run as drive
from mcmj.experiments.emulate import run as emulate
from mcmj.experiments.filters import run as filters
from mcmj.experiments.filters import switching
from mcmj.experiments.gaits import config as gaits_config
from mcmj.experiments.guided import run as guided
from mcmj.experiments.hard_cases import run as hard_cases
from mcmj.experiments.input_driven import config as input_driven_config
from mcmj.experiments.limit_cycle import config as limit_cycle_config
from mcmj.experiments.linearise import run as linearise
from mcmj.experiments.perturb import run as perturb
from mcmj.experiments.prune import run as prune
from mcmj.experiments.render import run as render
from mcmj.experiments.search import run as search
from mcmj.experiments.speed_accuracy import run as speed_accuracy
from mcmj.experiments.swing_up import run as swing_up
from mcmj.experiments.trunk import config as trunk_config
from mcmj.experiments.walk import config as walk_config
from mcmj.learning.environments.setting import Setting
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.robots.trunk import TrunkSettings
from mcmj.simulation.phases import Phase
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import McmjError

LIMIT_CYCLE = limit_cycle_config.Config
TIMED = (gaits_config, input_driven_config, limit_cycle_config, linearise, walk_config)
ABSURD = {  # in the default settings otherwise
    capacity: {
        "symbols": 10**9,
        "streams": 10**9,
        "sizes": (10**9,),
        "hold": 1e9,
        "threads": 10**9,
    },
    drive: {"nodes": 10**9, "population": 10**9, "control_timestep": 1e-300, "time_limit": 1e12},
    emulate: {"horizon": 1e12, "steps_ms": (1.0, 1e-300), "seed": 10**60},
    filters: {"train": 1e12, "symbols": 10**9, "taps": 10**9, "seed": -1},
    speed_accuracy: {"horizons": (1e12,), "repeats": 10**9, "steps_ms": (0.0,)},
    trunk_config: {"walking": 1e12, "teaching": 1e12, "pushes": 10**9},
    benchmark_config: {"sizes": (10**9,), "nodes": 10**9, "memory_steps": 10**12, "repeats": 10**9},
    perturb: {"timestep": 1e-320, "before": 1e12, "seeds": 10**9},
    certify_config: {"free_run": 1e12, "copies": 10**9},
    gaits_config: {"before": 1e12, "phases": 10**9},
    input_driven_config: {"free_run": 1e12, "sweep": 1e12},
    linearise: {"train": 1e12, "sizes": (10**9,)},
    walk_config: {"walking": 1e12, "settle": 1e12, "moments": 10**9},
    render: {"duration": 1e12, "stills": 10**9},
    hard_cases: {"duration": 1e12, "most_steps": 10**9},
    swing_up: {"free_run": 1e12, "kicks": 10**9},
    prune: {"free_run": 1e12, "starts": 10**9},
}
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
    *[
        (name, lambda m=module, n=name, v=value: m.Config(**{n: v}))
        for module, given in ABSURD.items()
        for name, value in given.items()
    ],
    ("switch_nodes", lambda: switching.SwitchConfig(switch_nodes=10**9)),
    ("exam", lambda: switching.SwitchConfig(exam=1e12)),
    ("nodes", lambda: TrunkSettings(nodes=10**9)),
    ("time_limit", lambda: Setting(time_limit=1e12)),
    ("rest_runs", lambda: Teaching(rest_runs=10**9)),
    ("duration", lambda: Teaching(duration=1e12)),
    ("trial", lambda: Practice(trial=1e12)),
    ("duration", lambda: Phase(1e12)),
    ("at most 1000000000 steps of 1e-09 s", lambda: LIMIT_CYCLE(timestep=1e-9)),
    ("steps", lambda: Simulation(random_body(0)).rollout(10**12)),
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
