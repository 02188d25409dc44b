"""What the perturbation experiment runs: its Config."""

from dataclasses import dataclass, replace

from mcmj.core.random_body import BodySettings
from mcmj.experiments.body_source import BodySource
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.learning.recipe import BODIES, PRACTICE, TEACHING, training_time
from mcmj.metrics import orbits
from mcmj.simulation.phases import Phase, RandomForces
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_targets
from mcmj.utils.validation import (
    require_duration,
    require_number,
    require_timestep,
)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all of these (by the same bodies); a .csv file;
            package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: a random body.
            It is always taught: readouts in the file are not used. Integrator and spring law
            are the file's, unless the engine is the twin.
        seed: of the random body, the noises and the forces.
        seeds: number of bodies of consecutive seeds for the table of successes.
        before, window, after: lengths of the phases: undisturbed, disturbed, free again [s].
        force: random forces are uniform in [-force, force] on every node [N].
        sensor_noise: standard deviation of the noise on the lengths [m].
        noise_curve: amplitudes of the curve of noise tolerance [m].
        tolerance: of the target orbit, over its RMS radius, for recovery and for success.
        error_window: the orbit error is that of this last part [s].
        timestep: control and physics step [s]; of a body that blows up with it, a half, then a
            quarter.
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        teaching: how the readout is taught.
        practice: how the body then practises, from rest and after disturbances.
    """

    task: str = "quadratic"
    body: str | None = None
    seed: int = 0
    seeds: int = 1
    before: float = 10.0
    window: float = 10.0
    after: float = 80.0
    force: float = 10.0
    sensor_noise: float = 0.1
    noise_curve: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
    tolerance: float = 0.05
    error_window: float = 20.0
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = BODIES
    teaching: Teaching = TEACHING
    practice: Practice = PRACTICE

    def __post_init__(self) -> None:
        period = max(wanted.period for wanted in self.targets.values())
        self.source  # noqa: B018  checks body, seeds and settings
        require_timestep("timestep", self.timestep)
        for name in ("before", "window", "after"):
            require_duration(name, getattr(self, name), self.timestep)
        for name in ("force", "sensor_noise", "tolerance"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("error_window", self.error_window, 0.0, self.after, open_low=True)
        for std in self.noise_curve:
            require_number("noise_curve", std, 0.0, open_low=True)
        require_number("after", self.after, 2 * period)
        require_number("error_window", self.error_window, orbits.PERIODS_NEEDED * period)

    @property
    def source(self) -> BodySource:
        """Of the bodies."""
        return BodySource(self.body, self.seed, self.seeds, self.settings, BODIES)

    @property
    def targets(self) -> dict[str, Target]:
        """What to learn, by name."""
        return named_targets(self.task)

    @property
    def perturbations(self) -> dict[str, Phase]:
        """The disturbed phases of Fig. 6, by name."""
        disturbed = Phase(self.window)
        return {
            **{
                f"frozen_x{output + 1}": replace(disturbed, freeze=(output,))
                for output in range(next(iter(self.targets.values())).n_outputs)
            },
            "random_forces": replace(disturbed, forces=RandomForces(self.force)),
            "length_noise": replace(disturbed, length_noise=self.sensor_noise),
        }


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar."""
    runs = 1 + len(config.perturbations) + len(config.noise_curve)
    run_length = config.before + config.window + config.after
    targets = config.targets.values()
    training = sum(training_time(t, config.teaching, config.practice) for t in targets)
    return config.seeds * round((training + len(targets) * runs * run_length) / config.timestep)
