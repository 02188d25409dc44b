"""What the emulation experiment runs: its Config."""

from dataclasses import dataclass

from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.emulate.systems import SYSTEMS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    SHORTEST_STEP,
    require_duration,
    require_name,
    require_number,
    require_seed,
)

REPORTED = 1.0  # ms: the step of the errors in metrics.json


@dataclass(frozen=True)
class Config:
    """What to emulate.

    Attributes:
        targets: names of emulated_systems.SYSTEMS.
        g: a G(x1, x2) of your own as text, as in --g="-x1 + (1 - x1**2) * x2"; target "user".
        integrators: mcmj's names.
        steps_ms: integration steps [ms], divisors of the horizon, 1 among them.
        horizon: length of the runs [s].
        mismatches: shares of p and q that K does not know, for the Van der Pol target under RK4.
        seed: for the record; nothing is random here.
    """

    targets: tuple[str, ...] = tuple(SYSTEMS)
    g: str | None = None
    integrators: tuple[str, ...] = tuple(INTEGRATORS)
    steps_ms: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
    horizon: float = 8.0
    mismatches: tuple[float, ...] = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
    seed: int = 0

    def __post_init__(self) -> None:
        require_name("target", SYSTEMS, *self.targets)
        require_name("integrator", INTEGRATORS, *self.integrators)
        require_seed("seed", self.seed)
        for step in self.steps_ms:
            require_number("steps_ms", step, 1e3 * SHORTEST_STEP)
            require_duration("horizon", self.horizon, 1e-3 * step)
            count = 1e3 * self.horizon / step
            if abs(count - round(count)) > 1e-9:
                raise InvalidArgumentError(
                    "steps_ms", f"divisors of the horizon {self.horizon:g} s", f"{step:g} ms"
                )
        if REPORTED not in self.steps_ms:
            raise InvalidArgumentError("steps_ms", "1 ms among them", self.steps_ms)

    @property
    def names(self) -> tuple[str, ...]:
        """All targets, the user's too."""
        return self.targets if self.g is None else (*self.targets, "user")
