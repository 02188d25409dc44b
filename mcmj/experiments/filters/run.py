"""Open-loop filters: what a body computes from its input, against regression without a body.

The body is driven by the input alone; a linear readout of its lengths is fitted on one stretch
and its nrmse_std taken on the next. The baselines are linear regressions on the input: of the
moment, and with delays. What the body does better than the second is nonlinear; what it does
better than the first is that, or memory (a plain delay is no feat beside the second).
"""

from mcmj.core.random_body import draw_body
from mcmj.experiments.filters.config import IN_SYMBOLS, SAMPLED, TIMESTEP, Config
from mcmj.experiments.filters.result import FilterResult, Result
from mcmj.experiments.filters.switching import run_switch
from mcmj.learning.regression import fit_readout
from mcmj.metrics import orbits
from mcmj.simulation.held_symbols import held_states
from mcmj.simulation.simulation import Simulation
from mcmj.targets.filter_tasks import (
    FilterTask,
    delayed_recall,
    delays,
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
            symbols = drive(config, task) if symbols is None else symbols
            filters[name] = fit_filter(config, task, symbols)
        else:
            filters[name] = fit_filter(config, task, drive(config, task))
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


def fit_filter(config: Config, task: FilterTask, states: Array) -> FilterResult:
    """Fit readouts of the states and of the baselines, and test them."""
    lags = delays(task.inputs, config.taps, task.tap_spacing)
    train, test = _parts(config, sampled=task.name in SAMPLED)
    wanted = task.targets[test]
    outputs = {
        name: _run_readout(x, task.targets, train, test)
        for name, x in (("", states), ("baseline_", lags), ("input_only_", task.inputs))
    }
    errors = {f"{name}nrmse_std": orbits.nrmse_std(y, wanted) for name, y in outputs.items()}
    return FilterResult(task, errors, outputs[""], wanted)


def _parts(config: Config, *, sampled: bool) -> tuple[slice, slice]:
    """The samples to fit on, and those to test on."""
    if sampled:
        first = round(config.washout / TIMESTEP)
        last = first + round(config.train / TIMESTEP)
        return slice(first, last, SPARSE), slice(last, None)
    last = config.washout_symbols + config.symbols
    return slice(config.washout_symbols, last), slice(last, None)


def _run_readout(x: Array, y: Array, train: slice, test: slice) -> Array:
    """Outputs on the test part of a readout with a bias, fitted on the other."""
    w_out = fit_readout(x[train], y[train], bias=True)
    found: Array = x[test] @ w_out[:-1] + w_out[-1]
    return found
