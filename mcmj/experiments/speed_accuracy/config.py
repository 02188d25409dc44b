"""What the comparison of integrators measures: its Config, and the bodies."""

from collections.abc import Callable
from dataclasses import dataclass

from mcmj.core.body import Body
from mcmj.core.random_body import random_body
from mcmj.experiments.speed_accuracy.methods import METHODS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    SHORTEST_STEP,
    require_count,
    require_duration,
    require_name,
    require_number,
    require_seed,
)

TOOLBOX = {"d1": (0.1, 2.0)}

BODIES: dict[str, Callable[[int], Body]] = {
    "toolbox_n10": lambda seed: random_body(seed, 10, **TOOLBOX),
    "toolbox_n30": lambda seed: random_body(seed, 30, **TOOLBOX),
    "toolbox_n100": lambda seed: random_body(seed, 100, **TOOLBOX),
    "toolbox_n300": lambda seed: random_body(seed, 300, **TOOLBOX),
    "small_area": lambda seed: random_body(seed, 30, width=1.0, height=1.0, **TOOLBOX),
    "stiff_springs": lambda seed: random_body(
        seed, 30, k1=(1e4, 1e5), k3=(1e6, 1e7), d1=(0.1, 2.0)
    ),
    "stiff_dampers": lambda seed: random_body(seed, 30, d1=(0.1, 2.0), d3=(1e3, 1e4)),
}


@dataclass(frozen=True)
class Config:
    """What to measure.

    Attributes:
        bodies: names of BODIES.
        methods: names of METHODS.
        steps_ms: integration steps [ms]; the horizons must be multiples of them.
        horizons: times at which the error is taken [s]; the last one is the table's.
        speed: initial speeds are uniform in +-speed [m/s].
        force: constant horizontal forces are uniform in +-force [N].
        seed: of bodies, forces and speeds.
        repeats: rounds of the cost measurement, of which the median counts.
        attractor: also run the general body's rhythms under other integrators than taught under.
    """

    bodies: tuple[str, ...] = tuple(BODIES)
    methods: tuple[str, ...] = METHODS
    steps_ms: tuple[float, ...] = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    horizons: tuple[float, ...] = (0.2, 2.0)
    speed: float = 0.5
    force: float = 1.0
    seed: int = 1
    repeats: int = 7
    attractor: bool = True

    def __post_init__(self) -> None:
        require_name("body", BODIES, *self.bodies)
        require_name("method", METHODS, *self.methods)
        require_seed("seed", self.seed)
        require_number("speed", self.speed, 0.0)
        require_number("force", self.force, 0.0)
        require_count("repeats", self.repeats, 1)
        for step in self.steps_ms:
            require_number("steps_ms", step, 1e3 * SHORTEST_STEP)
            for horizon in self.horizons:
                require_duration("horizons", horizon, 1e-3 * step)
                if abs(horizon * 1e3 / step - round(horizon * 1e3 / step)) > 1e-9:
                    raise InvalidArgumentError(
                        "steps_ms", f"divisors of the horizon {horizon:g} s", f"{step:g} ms"
                    )
