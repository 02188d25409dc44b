"""What the adoption of MuJoCo models runs: its Config."""

from dataclasses import dataclass, replace

import numpy as np

from mcmj.analysis.capacities import Probe
from mcmj.experiments.adopt.models import ADOPTIONS, Adoption, own_adoption
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_count, require_duration, require_number, require_seed

ALL = "all"


@dataclass(frozen=True)
class Config:
    """Which models learn, and how they are judged.

    Attributes:
        model: all, or one of swimmer, fish, cheetah, quadruped (these need dm_control),
            tensegrity, soft_arm; or the path of an MJCF file.
        sensors: what is heard: names or patterns of sensors, or "jointpos:*", "jointvel:*",
            "tendonpos:*" and the like. Needed for a file; for the others, their own.
        channels: names or patterns of the actuators that are driven; default: all.
        task: van_der_pol, .., a .csv file or package.module:function; default: the model's.
        pace: the target runs so many times faster; default: the model's, 1 for a file.
        drive: an actuator's gains are uniform in +-drive over the target's RMS radius;
            default: the model's.
        gain_seed: of the gains; default: the model's, 0 for a file.
        timestep: [s]; default: the model's.
        seed: of the first noise; the others follow.
        seeds: number of readouts taught, each under noise of its own.
        noise: standard deviation of the teacher noise, over the target's RMS radius.
        ridge_per_row: of the regression.
        periods: of the target under the teacher; the first three are washout.
        rounds: of practice from rest, at most.
        free_run: in closed loop, from the end of the teaching or from rest [s].
        after: in closed loop after a disturbance [s].
        window: last part of both, which is judged [s].
        threshold: orbit error below which a run counts as a success.
        symbols: shown to measure memory and capacity; 0: not measured.
        streams: shown to measure the kernel rank.
    """

    model: str = ALL
    sensors: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    task: str = ""
    pace: float | None = None
    drive: float | None = None
    gain_seed: int | None = None
    timestep: float | None = None
    seed: int = 0
    seeds: int = 10
    noise: float = 0.15
    ridge_per_row: float = 1e-8
    periods: float = 30.0
    rounds: int = 6
    free_run: float = 60.0
    after: float = 40.0
    window: float = 20.0
    threshold: float = 0.05
    symbols: int = 1000
    streams: int = 100

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        if self.gain_seed is not None:
            require_seed("gain_seed", self.gain_seed)
        require_count("seeds", self.seeds, 1)
        for name in ("rounds", "symbols"):
            require_count(name, getattr(self, name), 0)
        require_count("streams", self.streams, 2)
        for name in ("noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        require_number("periods", self.periods, 4.0)
        for name in ("free_run", "after", "window"):
            require_duration(name, getattr(self, name))
        require_number("window", self.window, 0.0, min(self.free_run, self.after), open_low=True)
        require_number("threshold", self.threshold, 0.0, open_low=True)
        for name in self.names:
            self.target(name)  # raises

    @property
    def names(self) -> list[str]:
        """Of the models that learn."""
        return list(ADOPTIONS) if self.model == ALL else [self.model]

    def adoption(self, name: str) -> Adoption:
        """How a model is used, with what is asked for here.

        Raises:
            InvalidArgumentError, UnknownNameError: no such model, or no sensors for a file.
        """
        changes = {
            field: getattr(self, field)
            for field in ("sensors", "channels", "task", "pace", "drive", "gain_seed", "timestep")
            if getattr(self, field) not in ((), "", None)
        }
        if name in ADOPTIONS:
            return replace(ADOPTIONS[name], **changes)
        if not name.lower().endswith((".xml", ".mjcf")):
            raise UnknownNameError("model", name, [ALL, *ADOPTIONS, "a path to an .xml file"])
        if not self.sensors:
            raise InvalidArgumentError("sensors", f"some for {name}, such as 'jointpos:*'", "none")
        return replace(own_adoption(name, self.sensors), **changes)

    def target(self, name: str) -> Target:
        """What a model learns, at its pace."""
        adoption = self.adoption(name)
        return named_target(adoption.task).faster(adoption.pace)

    def teaching(self, period: float, radius: float) -> Teaching:
        """For a target of that period [s] and RMS radius."""
        return Teaching(
            duration=self.periods * period, washout=3 * period, noise=self.noise * radius,
            bias=True, ridge_per_row=self.ridge_per_row,
        )  # fmt: skip

    def practice(self, period: float) -> Practice:
        """For a target of that period [s]."""
        return Practice(
            rounds=self.rounds, round_duration=10 * period, round_weight=1e-3,
            trial=20 * period, trial_window=5 * period, good_enough=0.03,
        )  # fmt: skip

    def probe(self, target: Target) -> Probe:
        """Symbols in place of the first output, as large, each for a tenth of the period."""
        return Probe(
            seed=self.seed, symbols=self.symbols, washout=50, hold=target.period / 10,
            strength=float(np.abs(target.orbit(512)[:, 0]).max()), max_delays=(30, 8, 4),
            streams=self.streams, stream_symbols=10, shared=5, resolution=0.01, relative=True,
        )  # fmt: skip


def total_readouts(config: Config) -> int:
    """For a progress bar: readouts taught, and a measure of each model's worth."""
    return len(config.names) * (config.seeds + 1)
