"""What the input-driven experiment runs: its Config, and the body and readout it asks for."""

import warnings
from dataclasses import dataclass
from typing import Any

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings
from mcmj.experiments.body_source import BodySource
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.targets.input_profiles import Profile, Ramp, hold
from mcmj.targets.input_systems import QUADRATIC
from mcmj.utils.errors import InvalidArgumentError, McmjWarning, UnknownNameError
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_timestep,
)

SYSTEM = QUADRATIC
PROFILES = {
    "ramp": "lin 0.1 5 200",  # the paper's
    "mixed": "log 0.1 5 240, log 5 0.1 200, hold 0.1 20, log 0.1 5 240, hold 5 100",
}
DRAWN = BodySettings(
    nodes=100, n_inputs=1, input_fraction=0.2, input_scale=2.0, feedback_fraction=1.0
)
PRACTICE = Practice(
    rounds=6, round_runs=1, round_duration=40.0, trial_window=30.0, good_enough=0.03
)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj; default: a random body.
            If the file holds a readout, nothing is taught.
        readout: name of one of the file's readouts; default: the one it runs.
        teach: teach a body file anew; body.xml then holds its old readouts too.
        seed: of the random body and the noise.
        seeds: number of random bodies of consecutive seeds, for rates.
        profile: input during teaching: ramp, mixed, or your own, such as
            "log 0.1 5 320, hold 5 60" (targets.input_profiles). It should end
            where the inputs jump from.
        run_in: at the profile's first value, before it; not learned from [s].
        inputs: constant inputs to jump to, each from the state after teaching.
        curve: more of them, for amplitude and frequency against the input.
        free_run: length of the closed loop at each of them [s].
        window: the errors are those of this last part of it [s].
        sweep: duration of the slow way from the largest input taught to the smallest, and
            of that back up [s]; 0: none.
        tolerance: largest orbit error of a success.
        noise: standard deviation of the white noise on the fed-back teacher.
        ridge_per_row: see Teaching.
        every: see Teaching.
        timestep: control and physics step [s].
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        phases: the jumps are practised from so many moments of the cycle at the profile's end.
        practice: how a body practises the jumps that it misses after teaching.
    """

    body: str | None = None
    readout: str | None = None
    teach: bool = False
    seed: int = 0
    seeds: int = 1
    profile: str = "mixed"
    run_in: float = 20.0
    inputs: tuple[float, ...] = (5.0, 1.0, 0.2)
    curve: tuple[float, ...] = (0.1, 0.14, 0.3, 0.5, 0.7, 1.5, 2.0, 3.0, 4.0)
    free_run: float = 80.0
    window: float = 30.0
    sweep: float = 400.0
    tolerance: float = 0.05
    noise: float = 0.4
    ridge_per_row: float = 0.0
    every: int = 10
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = DRAWN
    phases: int = 1
    practice: Practice = PRACTICE

    def __post_init__(self) -> None:
        self.source  # noqa: B018  checks body, seeds and settings
        require_count("phases", self.phases, 1)
        require_number("tolerance", self.tolerance, 0.0, open_low=True)
        require_timestep("timestep", self.timestep)
        require_duration("free_run", self.free_run, self.timestep)
        for name in ("run_in", "sweep"):
            require_duration(name, getattr(self, name), self.timestep, open_low=False)
        require_number("window", self.window, 0.0, self.free_run, open_low=True)
        if not self.inputs:
            raise InvalidArgumentError("inputs", "at least one", self.inputs)
        for name in ("inputs", "curve"):
            for value in getattr(self, name):
                require_number(name, value, 0.0, open_low=True)
        if self.readout is not None and self.body is None:
            raise InvalidArgumentError("readout", "a body file that holds it", self.readout)
        if self.readout is not None and self.teach:
            raise InvalidArgumentError(
                "readout", "none of the file's where one is taught", self.readout
            )
        self.teaching  # noqa: B018  checks the rest

    @property
    def source(self) -> BodySource:
        """Of the bodies."""
        return BodySource(self.body, self.seed, self.seeds, self.settings, DRAWN)

    @property
    def readout_name(self) -> str:
        """Of the readout that is run, in body.xml."""
        return self.readout or (self.profile if self.profile in PROFILES else "custom")

    @property
    def course(self) -> Profile:
        """The whole of teaching: the run-in, then the profile."""
        profile = Profile.parse(PROFILES.get(self.profile, self.profile))
        require_number("profile's smallest value", profile.low, 0.0, open_low=True)
        if self.run_in == 0:
            return profile
        return Profile([hold(profile.ramps[0].start, self.run_in), *profile.ramps])

    @property
    def teaching(self) -> Teaching:
        """Settings of the regression; the course is the lesson."""
        return Teaching(
            duration=self.course.duration,
            washout=self.run_in,
            noise=self.noise,
            ridge_per_row=self.ridge_per_row,
            every=self.every,
        )

    @property
    def all_inputs(self) -> list[float]:
        """Inputs to jump to and those of the curve, in ascending order."""
        return sorted({*self.inputs, *self.curve})


@dataclass(frozen=True)
class Start:
    """A body ready for the experiment.

    Attributes:
        w_out: readout that came with it; None: to be taught.
        taught: smallest and largest input it is or was taught with.
        readouts: all that the file holds, by name.
        source: where the body comes from.
        lessons: what each of the readouts was taught with, by name.
        stepping: arguments of the Simulation.
    """

    body: Body
    w_out: Array | None
    taught: tuple[float, float]
    readouts: dict[str, Array]
    source: dict[str, object]
    lessons: dict[str, object]
    stepping: dict[str, Any]


def get_start(config: Config, seed: int) -> Start:
    """The body of a seed, or the config's.

    Raises:
        BodyFileError, UnknownNameError: no such file, or no such readout in it.
        InvalidArgumentError: a body without the channels that the system needs.
    """
    course = config.course
    taught = (course.low, course.high)
    stored = config.source.get(seed)
    stepping = stored.take(timestep=config.timestep, engine=config.engine)
    body, readouts, account = stored.body, stored.readouts, stored.provenance
    check_channels(body)
    w_out = None if config.teach else _readout(config.readout, stored.w_out, readouts)
    if w_out is not None:
        taught = tuple(account.get("taught_inputs", taught))
    source, lessons = account.get("body", account), account.get("lessons", {})
    return Start(body, w_out, taught, readouts, source, lessons, stepping)


def _readout(name: str | None, active: Array | None, readouts: dict[str, Array]) -> Array | None:
    if name is None:
        return active
    if name not in readouts:
        raise UnknownNameError("readout of the body file", name, readouts)
    return readouts[name]


def check_channels(body: Body) -> None:
    """Raise unless a body has one input channel and a feedback channel per output."""
    if body.n_inputs != 1:
        raise InvalidArgumentError("body", "one input channel", f"{body.n_inputs}")
    if body.n_outputs != 2:
        raise InvalidArgumentError("body", "2 feedback channels", f"{body.n_outputs}")


def warn_outside(config: Config, taught: tuple[float, float]) -> None:
    """Inputs outside the range of teaching are extrapolation: say so."""
    low, high = taught
    outside = [u for u in config.all_inputs if not low <= u <= high]
    if outside:
        warnings.warn(
            f"inputs outside the taught range of {low:g} to {high:g}: "
            f"{', '.join(f'{u:g}' for u in outside)}; the body was not taught what to do there",
            McmjWarning,
            stacklevel=3,
        )


def sweep_profile(config: Config, taught: tuple[float, float]) -> Profile:
    """Down from the largest taught input to the smallest, and up again."""
    low, high = taught
    down = Ramp(high, low, config.sweep, geometric=True)
    return Profile([down, Ramp(low, high, config.sweep, geometric=True)])


def total_steps(config: Config) -> int:
    """Control steps of a whole run with teaching, for a progress bar."""
    one = config.course.duration + len(config.inputs) * config.free_run
    extra = (len(config.all_inputs) - len(config.inputs)) * config.free_run + 2 * config.sweep
    return round((config.seeds * one + extra) / config.timestep)
