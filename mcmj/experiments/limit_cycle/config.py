"""What the limit-cycle experiment runs: its Config, and the body and readouts it asks for."""

from dataclasses import dataclass, fields, replace
from typing import Any

from mcmj.core.body import Body
from mcmj.core.options import ENGINES
from mcmj.core.random_body import BodySettings
from mcmj.experiments.body_source import BodySource
from mcmj.learning.free_run import WINDOW
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.learning.recipe import BODIES, PRACTICE, TEACHING, training_time
from mcmj.metrics import orbits
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_targets, require_outputs
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    Array,
    require_duration,
    require_name,
    require_number,
    require_timestep,
)

Found = tuple[Body, dict[str, Array], dict[str, object], dict[str, Any]]  # what get_body gives


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, quadratic, lissajous, or all of these (by the same body); a gait; a .csv
            file; package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: the general
            body, unless a seed or changed settings ask for a new random one. If the file
            holds a readout for the task, nothing is taught.
        seed: of the random body and of the noise; default 0.
        seeds: number of bodies, random ones of consecutive seeds if more than one. The first is
            shown; of all it is counted how many learn it.
        threshold: largest orbit error of a success.
        free_run: length of the free run in closed loop [s].
        window: the errors are those of this last part of it [s].
        timestep: control and physics step [s]; of a body that blows up with it, a half, then a
            quarter.
        integrator: as for Simulation; default: the body file's, or Simulation's.
        engine: mujoco, or twin: faster, the same to rounding, no video.
        windows: length [s] of the consecutive windows of the free run whose errors are given
            too; 0: none.
        measure_cost: measure what a step in closed loop costs in MuJoCo.
        settings: what a random body is drawn from.
        teaching: how the readout is taught.
        practice: how the body then practises, from rest and after disturbances.
    """

    task: str = "all"
    body: str | None = None
    seed: int | None = None
    seeds: int = 1
    threshold: float = 0.05
    free_run: float = 120.0
    window: float = 20.0
    timestep: float = 1e-3
    integrator: str | None = None
    engine: str = "mujoco"
    windows: float = WINDOW
    measure_cost: bool = True
    settings: BodySettings = BODIES
    teaching: Teaching = TEACHING
    practice: Practice = PRACTICE

    def __post_init__(self) -> None:
        longest = max(wanted.period for wanted in self.targets.values())
        self.source  # noqa: B018  checks body, seeds and settings
        require_number("threshold", self.threshold, 0.0, open_low=True)
        require_timestep("timestep", self.timestep)
        require_duration("free_run", self.free_run, self.timestep)
        require_number("window", self.window, 0.0, self.free_run, open_low=True)
        if self.windows != 0.0:
            require_number("windows", self.windows, orbits.PERIODS_NEEDED * longest)
        require_name("engine", ENGINES, self.engine)

    @property
    def targets(self) -> dict[str, Target]:
        """What to learn, by name."""
        return named_targets(self.task)

    @property
    def noise_seed(self) -> int:
        """The seed, or its default."""
        return self.source.first_seed

    @property
    def source(self) -> BodySource:
        """Of the bodies."""
        return BodySource(self.body, self.seed, self.seeds, self.settings, BODIES, "general")


def get_body(config: Config) -> Found:
    """The config's body, its readouts, where it comes from, and arguments of its Simulation."""
    stored = config.source.get(config.noise_seed)
    stepping = stored.take(
        timestep=config.timestep, integrator=config.integrator, engine=config.engine
    )
    readouts = stored.readouts
    if not readouts and stored.w_out is not None and config.task != "all":
        readouts = dict.fromkeys(config.targets, stored.w_out)
    return stored.body, readouts, stored.provenance, stepping


def of_seed(config: Any, index: int) -> Config:
    """The limit-cycle experiment of the body number `index`.

    Args:
        config: of an experiment with some of the same fields, `seeds` among them.
    """
    names = {field.name for field in fields(Config)} & {field.name for field in fields(config)}
    one = Config(**{name: getattr(config, name) for name in names})
    return replace(one, seed=one.source.all_seeds[index] if one.seeds > 1 else one.seed, seeds=1)


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar; rounds of practice are not foreseen."""
    targets = config.targets.values()
    training = sum(training_time(t, config.teaching, config.practice) for t in targets)
    return config.seeds * round((training + len(targets) * config.free_run) / config.timestep)


def check_task(config: Config, body: Body, wanted: Target) -> None:
    """Check that a body has the channels, and the window the length, that a target needs.

    Raises:
        InvalidArgumentError: one of them does not.
    """
    require_outputs(body, wanted)
    if config.window < orbits.PERIODS_NEEDED * wanted.period:
        raise InvalidArgumentError(
            "window",
            f"at least {orbits.PERIODS_NEEDED} periods of {wanted.period:.4g} s ({wanted.name})",
            f"{config.window:g} s",
        )
