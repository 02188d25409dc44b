"""What the hard cases are run with: their Config."""

from dataclasses import dataclass

from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.hard_cases.bodies import CASES
from mcmj.utils.validation import (
    require_count,
    require_duration,
    require_name,
    require_number,
    require_seed,
)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        cases: names from CASES.
        integrators: MuJoCo's, or mcmj's own.
        seed: of the bodies and the starts.
        duration: of a run [s]; shorter where `most_steps` does not reach it.
        most_steps: of a run.
        precision: the bisection ends when its bounds differ by this share.
    """

    cases: tuple[str, ...] = ()
    integrators: tuple[str, ...] = tuple(INTEGRATORS)
    seed: int = 0
    duration: float = 1.0
    most_steps: int = 20_000
    precision: float = 0.03

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        require_count("most_steps", self.most_steps, 100)
        require_duration("duration", self.duration)
        require_number("precision", self.precision, 0.0, 1.0, open_low=True)
        if not self.cases:
            object.__setattr__(self, "cases", tuple(CASES))
        require_name("hard case", CASES, *self.cases)
        require_name("integrator", INTEGRATORS, *self.integrators)
