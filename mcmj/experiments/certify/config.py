"""What the certificate runs: its Config."""

from dataclasses import dataclass

from mcmj.analysis.stability.loop import INTEGRATOR
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.learning.recipe import PRACTICE, TEACHING
from mcmj.metrics import orbits
from mcmj.targets.named import named_target
from mcmj.utils.validation import (
    as_array,
    require_above,
    require_count,
    require_duration,
    require_number,
    require_seed,
)


@dataclass(frozen=True)
class Config:
    """What to certify, under MuJoCo's Euler, whose state has no memory.

    Attributes:
        task: van_der_pol, .., a .csv file or package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body. If the file holds a readout for the task, nothing is taught.
        seed: of all noise; with no body, of a new random body if given.
        free_run: MuJoCo run whose last `window` the errors are of [s].
        window: [s].
        recovery: time to come back to the orbit [s].
        threshold: largest orbit error of a recovery.
        scales: of the target that the teacher starts the body with, > 0.
        phases: at which it lets go, for each scale.
        kicks: RMS velocity kicks, in units of the nodes' RMS speed on the cycle.
        pushes: amplitudes F of random constant forces in [-F, F] for 1 s [N].
        copies: of each kick and push, and of the tolerances.
        refine: steps so much smaller for a second after a kick, and during a push.
        diffusion_noise: on the lengths, for the phase diffusion [m].
        teaching: how the readout is taught, if it is.
        practice: how the body then practises, from rest and after disturbances.
    """

    task: str = "van_der_pol"
    body: str | None = None
    seed: int | None = None
    free_run: float = 60.0
    window: float = 20.0
    recovery: float = 40.0
    threshold: float = 0.05
    scales: tuple[float, ...] = (0.1, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)
    phases: int = 24
    kicks: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
    pushes: tuple[float, ...] = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
    copies: int = 16
    refine: int = 20
    diffusion_noise: float = 1e-4
    teaching: Teaching = TEACHING
    practice: Practice = PRACTICE

    def __post_init__(self) -> None:
        period = named_target(self.task).period
        for name in ("threshold", "diffusion_noise"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        if self.seed is not None:
            require_seed("seed", self.seed)
        for name in ("free_run", "recovery"):
            require_duration(name, getattr(self, name))
        require_number("window", self.window, orbits.PERIODS_NEEDED * period, self.free_run)
        require_number("recovery", self.recovery, 3 * period)
        for name in ("scales", "kicks", "pushes"):
            levels = as_array(name, getattr(self, name), (None,))
            require_above(name, levels, 0.0)
            require_count(f"number of {name}", len(levels), 1)
        for name, low in (("phases", 1), ("copies", 4), ("refine", 1)):
            require_count(name, getattr(self, name), low)

    @property
    def noise_seed(self) -> int:
        """The seed, or its default."""
        return 0 if self.seed is None else self.seed

    @property
    def of_body(self) -> limit_cycle.Config:
        """The limit-cycle experiment that has the same body, under the integrator certified."""
        return limit_cycle.Config(
            task=self.task, body=self.body, seed=self.seed, integrator=INTEGRATOR
        )
