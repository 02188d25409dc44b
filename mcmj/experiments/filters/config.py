"""What the filter experiment runs: its Config."""

from dataclasses import dataclass, field

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import BodySettings
from mcmj.experiments.filters.switching import SwitchConfig
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    require_count,
    require_duration,
    require_name,
    require_number,
    require_seed,
)

SAMPLED = ("volterra", "toolbox_narma")  # one input a millisecond
IN_SYMBOLS = ("narma10", "delayed_recall")  # which share their input, and so one run
TASKS = (*SAMPLED, *IN_SYMBOLS, "switch")
TIMESTEP = 1e-3  # s
REPEAT = 50.0  # s: after which the input of the tasks at 1 ms comes back


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
        require_name("task", TASKS, *self.tasks)
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
