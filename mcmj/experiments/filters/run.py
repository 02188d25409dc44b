"""Open-loop filters: what a body computes from its input, against regression without a body.

The body is driven by the input alone; a linear readout of its lengths is fitted on one stretch
and its nrmse_std taken on the next. The baselines are linear regressions on the input: of the
moment, and with delays. What the body does better than the second is nonlinear; what it does
better than the first is that, or memory (a plain delay is no feat beside the second).
"""

from dataclasses import dataclass, field

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import BodySettings, draw_body
from mcmj.experiments.filters.switching import SwitchConfig, SwitchResult, run_switch
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
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)

SAMPLED = ("volterra", "toolbox_narma")  # one input a millisecond
IN_SYMBOLS = ("narma10", "delayed_recall")  # which share their input, and so one run
TASKS = (*SAMPLED, *IN_SYMBOLS, "switch")
TIMESTEP = 1e-3  # s
REPEAT = 50.0  # s: after which the input of the tasks at 1 ms comes back
SPARSE = 10  # one in so many samples of a 1 ms task is regressed on: neighbours say the same


def filtering_body() -> BodySettings:
    """Stiffer and smaller than the rhythms' bodies, near the toolbox's two filter scripts."""
    return BodySettings(
        nodes=60, width=10.0, height=10.0, k1=(20.0, 400.0), k3=(10.0, 100.0), d1=(1.0, 100.0),
        d3=(1.0, 100.0), n_inputs=1, n_outputs=0,
    )  # fmt: skip


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        tasks: any of volterra, toolbox_narma, narma10, delayed_recall, switch.
        seed: of the body and the inputs.
        train, washout, test: lengths of the parts of the tasks at 1 ms [s]. Their input is a
            product of sines that comes back, with its sign changed, after 50 s: train and test
            must fit into that, or what is tested was taught.
        symbols, washout_symbols, test_symbols: lengths of the parts of the tasks in symbols.
        hold: how long a symbol is shown [s]: so long that the body can follow it, so short that
            it remembers ten of them. Its undamped modes (seed 0) are at 0.2 to 6 Hz.
        gain: force per unit input, on top of the input weights: large ones use the springs'
            nonlinearity, small ones their memory.
        volterra_gain: the same for the Volterra task, whose input is a fifth as large.
        delay: of delayed_recall [symbols].
        taps: delays of the input that the baseline has, the present among them.
        integrator: as for Simulation.
        engine: mujoco, or twin for quick looks.
        settings: what the body is drawn from.
        switch: the task that needs feedback.
    """

    tasks: tuple[str, ...] = TASKS
    seed: int = 0
    train: float = 30.0
    washout: float = 20.0
    test: float = 20.0
    symbols: int = 2000
    washout_symbols: int = 100
    test_symbols: int = 500
    hold: float = 0.2
    gain: float = 1.0
    volterra_gain: float = 5.0
    delay: int = 5
    taps: int = 30
    integrator: str = DEFAULT_INTEGRATOR
    engine: str = "mujoco"
    settings: BodySettings = field(default_factory=filtering_body)
    switch: SwitchConfig = field(default_factory=SwitchConfig)

    def __post_init__(self) -> None:
        for name in self.tasks:
            if name not in TASKS:
                raise UnknownNameError("task", name, TASKS)
        require_seed("seed", self.seed)
        for name in ("train", "washout", "test", "hold"):
            require_duration(name, getattr(self, name))
        for name in ("gain", "volterra_gain"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        for name in ("symbols", "washout_symbols", "test_symbols", "delay", "taps"):
            require_count(name, getattr(self, name), 1)
            require_duration(f"{name} x hold", getattr(self, name) * self.hold)
        if self.train + self.test > REPEAT:
            raise InvalidArgumentError(
                "train", f"train + test <= {REPEAT:g} s, after which the input comes back",
                f"{self.train + self.test:g} s",
            )  # fmt: skip


@dataclass(frozen=True)
class FilterResult:
    """One task.

    Attributes:
        task: what was asked.
        errors: on held-out data, nrmse_std of the body, baseline_nrmse_std of regression on
            the input and its delays, input_only_nrmse_std of that on the input alone.
        outputs, wanted: (M, 1) the body's and the target's held-out values.
    """

    task: FilterTask
    errors: dict[str, float]
    outputs: Array
    wanted: Array


@dataclass(frozen=True)
class Result:
    """What was measured."""

    config: Config
    filters: dict[str, FilterResult]
    switch: SwitchResult | None

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {name: r.errors for name, r in self.filters.items()}
        if self.switch is not None:
            table["switch"] = self.switch.metrics
        return table


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
    return x[test] @ w_out[:-1] + w_out[-1]
