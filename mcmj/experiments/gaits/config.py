"""What the gaits experiment runs: its Config, and the body and readouts it asks for."""

from dataclasses import dataclass, field, replace
from itertools import permutations

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings
from mcmj.experiments.body_source import BodySource
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.metrics import orbits
from mcmj.mjcf.bundled import StoredBody
from mcmj.targets.gaits import GAITS, LEGS, gait_target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import (
    require_count,
    require_duration,
    require_names,
    require_number,
    require_timestep,
)

# the default body with all its motion 1.5 times faster, for a walk's swing is fast: stiffness and
# forces x 1.5^2, d1 x 1.5, d3 / 1.5; chosen, like the teaching, on bodies of seeds 100 to 119
DRAWN = BodySettings(
    nodes=50, k1=(2.25, 22.5), k3=(225.0, 450.0), d1=(0.45, 9.0), d3=(67.0, 133.0),
    n_outputs=len(LEGS), feedback_scale=22.5,
)  # fmt: skip
TAUGHT = Teaching(duration=100.0, ridge_per_row=1e-7)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        gaits: which, and in which order; the first is the one that the figure switches from.
        body: a body file, or the name of a body that comes with mcmj; default: gaits, unless
            a seed, several seeds or changed settings ask for random ones. A gait whose readout
            is in the file is not taught.
        seed: of the random body and of the noise; default 0.
        seeds: number of random bodies of consecutive seeds, for rates.
        free_run: of each gait in closed loop, from the end of teacher forcing on [s].
        before: a switch comes after this time in the first gait [s].
        after: it has this time to converge to the second [s].
        from_rest: length of the runs from total rest [s].
        window: the errors are those of this last part of every run [s].
        tolerance: of the target orbit, over its RMS radius, for the switching time; and of
            orbit and period error for success.
        timestep: control and physics step [s].
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        teaching: how the readouts are taught, each for itself.
        practice: how each then practises from rest and from the other gaits.
        phases: of each of the other gaits that it practises from.
    """

    gaits: tuple[str, ...] = tuple(GAITS)
    body: str | None = None
    seed: int | None = None
    seeds: int = 1
    free_run: float = 60.0
    before: float = 15.0
    after: float = 80.0
    from_rest: float = 80.0
    window: float = 20.0
    tolerance: float = 0.05
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = DRAWN
    teaching: Teaching = field(default_factory=lambda: TAUGHT)
    practice: Practice = field(default_factory=lambda: Practice(trial=60.0))
    phases: int = 12

    def __post_init__(self) -> None:
        require_names("gait", self.gaits, GAITS)
        self.source  # noqa: B018  checks body, seeds and settings
        require_count("phases", self.phases, 1)
        for name in ("tolerance", "window"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_timestep("timestep", self.timestep)
        for name in ("before", "free_run", "after", "from_rest"):
            require_duration(name, getattr(self, name), self.timestep)
        for name in ("free_run", "after", "from_rest"):
            require_number(name, getattr(self, name), self.window)

    @property
    def source(self) -> BodySource:
        """Of the bodies."""
        return BodySource(self.body, self.seed, self.seeds, self.settings, DRAWN, "gaits")

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All ordered switches."""
        return tuple(permutations(self.gaits, 2))


def get_body(config: Config, seed: int) -> StoredBody:
    """The body of a seed, or the config's, with the readouts that it holds for the gaits."""
    stored = config.source.get(seed)
    held = stored.readouts
    return replace(stored, readouts={name: held[name] for name in config.gaits if name in held})


def check(config: Config, body: Body) -> None:
    """Check that a body has a feedback channel a leg, and the window the length for a period.

    Raises:
        InvalidArgumentError: one of them does not.
    """
    if body.n_outputs != len(LEGS):
        channels = f"{len(LEGS)} feedback channels ({', '.join(LEGS)})"
        raise InvalidArgumentError("body", channels, body.n_outputs)
    longest = max(gait_target(name).period for name in config.gaits)
    require_number("window", config.window, orbits.PERIODS_NEEDED * longest)


def total_steps(config: Config) -> int:
    """Control steps of a whole run if everything is taught, for a progress bar."""
    trials = (1 + config.phases * (len(config.gaits) - 1)) * config.practice.trial
    of_a_gait = config.teaching.total + trials + config.free_run + config.from_rest
    seconds = len(config.gaits) * of_a_gait + len(config.pairs) * (config.before + config.after)
    return config.seeds * round(seconds / config.timestep)
