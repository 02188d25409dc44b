"""What the swing-up experiment runs: its Config."""

from dataclasses import dataclass

from mcmj.core.random_body import BodySettings
from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.learning.recipe import BODIES, PRACTICE, TEACHING, training_time
from mcmj.utils.validation import require_count, require_number


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all of these (by the same body); a gait; a .csv
            file; package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body, unless a seed, several seeds or changed settings ask for random ones.
        seed: of the random body and of the noise; default 0.
        seeds: number of random bodies of consecutive seeds, for rates.
        free_run: length of the run from rest [s].
        window: the orbit error is that of this last part of it [s].
        tolerance: of the target orbit, over its RMS radius, for the swing-up time and for
            success.
        timestep: control and physics step [s]; of a body that blows up with it, a half, then a
            quarter.
        engine: mujoco, or twin: faster, the same to rounding.
        kicks: number of further starts, with the nodes kicked, that show how wide the way
            onto the orbit is; 0: none.
        kick_speed: standard deviation of their first velocities [m/s]; on the orbit nodes move
            at about 0.05 m/s.
        settings: what a random body is drawn from.
        teaching: how the readout is taught, runs from rest included.
        practice: how the body then practises, from rest and after disturbances.
    """

    task: str = "all"
    body: str | None = None
    seed: int | None = None
    seeds: int = 1
    free_run: float = 80.0
    window: float = 20.0
    tolerance: float = 0.05
    timestep: float = 1e-3
    engine: str = "mujoco"
    kicks: int = 8
    kick_speed: float = 0.02
    settings: BodySettings = BODIES
    teaching: Teaching = TEACHING
    practice: Practice = PRACTICE

    def __post_init__(self) -> None:
        require_count("kicks", self.kicks, 0)
        require_number("kick_speed", self.kick_speed, 0.0)
        require_number("tolerance", self.tolerance, 0.0, open_low=True)
        self.of_seed(0)  # checks the rest

    def of_seed(self, index: int) -> limit_cycle.Config:
        """The limit-cycle experiment of the body number `index`."""
        return limit_cycle.of_seed(self, index)


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar; rounds of practice are not foreseen."""
    targets = config.of_seed(0).targets.values()
    training = sum(training_time(t, config.teaching, config.practice) for t in targets)
    runs = len(targets) * (1 + config.kicks)
    return config.seeds * round((training + runs * config.free_run) / config.timestep)
