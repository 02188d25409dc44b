"""Open-loop filters: what a body computes from its input, against regression without a body.

`mcmj.learning.filters` does the same with any reservoir, and says what the baselines are.
"""

from mcmj.core.random_body import draw_body
from mcmj.experiments.filters.config import IN_SYMBOLS, SAMPLED, TIMESTEP, Config
from mcmj.experiments.filters.result import Result
from mcmj.experiments.filters.switching import run_switch
from mcmj.learning.filters import FilterResult, fit_filter
from mcmj.simulation.held_symbols import held_states
from mcmj.simulation.simulation import Simulation
from mcmj.targets.filter_tasks import (
    FilterTask,
    delayed_recall,
    narma10,
    toolbox_narma,
    volterra,
)
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

SPARSE = 10  # one in so many samples of a 1 ms task is regressed on: neighbours say the same


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Run every task; the filters by one body."""
    filters: dict[str, FilterResult] = {}
    symbols: Array | None = None  # states under the input that two tasks share
    for name in config.tasks:
        if name == "switch":
            continue
        task = make_task(config, name)
        if name in IN_SYMBOLS:
            states = symbols = drive(config, task) if symbols is None else symbols
        else:
            states = drive(config, task)
        train, test = _parts(config, sampled=name in SAMPLED)
        filters[name] = fit_filter(task, states, train, test, config.taps)
        on_steps(1)
    switch = None
    if "switch" in config.tasks:
        switch = run_switch(config.switch, config.seed, engine=config.engine)
        on_steps(1)
    return Result(config, filters, switch)


def make_task(config: Config, name: str) -> FilterTask:
    """The task of that name, as long as the config says."""
    steps = round((config.washout + config.train + config.test) / TIMESTEP)
    if name == "volterra":
        return volterra(steps, TIMESTEP)
    if name == "toolbox_narma":
        return toolbox_narma(steps, TIMESTEP)
    symbols = config.washout_symbols + config.symbols + config.test_symbols
    narma = narma10(stream(config.seed, "task_inputs"), symbols)
    return narma if name == "narma10" else delayed_recall(narma.inputs, config.delay)


def drive(config: Config, task: FilterTask) -> Array:
    """Elongations (M, L) [m] of the body at the end of each symbol.

    Raises:
        DivergenceError: the body blew up.
    """
    body = draw_body(config.seed, config.settings)
    sim = Simulation(body, timestep=TIMESTEP, integrator=config.integrator, engine=config.engine)
    gain = config.volterra_gain if task.name == "volterra" else config.gain
    hold = 1 if task.name in SAMPLED else round(config.hold / TIMESTEP)
    return held_states(sim, gain * task.inputs, hold) - body.rest_lengths


def _parts(config: Config, *, sampled: bool) -> tuple[slice, slice]:
    """The samples to fit on, and those to test on."""
    if sampled:
        first = round(config.washout / TIMESTEP)
        last = first + round(config.train / TIMESTEP)
        return slice(first, last, SPARSE), slice(last, None)
    last = config.washout_symbols + config.symbols
    return slice(config.washout_symbols, last), slice(last, None)
