"""What is to be taught, and how: lessons of teacher forcing; mcmj.learning.teaching gives them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_count, require_duration, require_number

HELD, HELD_SIZE = 10.0, 1.5  # s; of the target's largest values
Signal = Callable[[Array], Array]  # times (T,) [s] -> (T, n)


@dataclass(frozen=True)
class Teaching:
    """How a readout is taught.

    Attributes:
        duration: teacher forcing, washout included [s].
        washout: start of it that the regression leaves out [s].
        noise: standard deviation of the white noise on the fed-back teacher signal (units of
            the output); the regression target stays clean. Without it the free run drifts off.
        drift: standard deviation of slow noise beside it, which see in `TeacherNoise`. It makes
            the rhythm attract from further away; too much of it biases the orbit.
        drift_time: over which the slow noise forgets [s].
        length_noise: standard deviation of white noise on the lengths the readout sees [m].
        ridge_per_row: ridge parameter over the number of rows (the sum of their weights); s^2
            does what a length noise of s would, without randomness.
        bias: fit a constant too (the paper's readout has none).
        every: the regression takes every n-th step only: neighbours at 1 ms are nearly equal.
        rest_runs: number of runs taught from total rest, without washout, beside the one
            above; they teach the body to swing up.
        held_runs: number of runs taught after HELD seconds in which constant outputs, up
            to HELD_SIZE times the target's largest and of either sign, are fed back;
            they teach it to come back from afar.
        away_duration: of each of these runs [s]; from rest the target starts at time 0.
        away_weight: of their squared errors, against 1. Small, for a linear readout cannot
            serve all well.
    """

    duration: float = 120.0
    washout: float = 20.0
    noise: float = 0.2
    drift: float = 0.0
    drift_time: float = 1.0
    length_noise: float = 0.0
    ridge_per_row: float = 0.0
    bias: bool = False
    every: int = 1
    rest_runs: int = 0
    held_runs: int = 0
    away_duration: float = 30.0
    away_weight: float = 1e-2

    def __post_init__(self) -> None:
        require_duration("duration", self.duration)
        require_washout(self.washout, self.duration)
        for name in ("noise", "drift", "length_noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        require_duration("drift_time", self.drift_time)
        require_count("every", self.every, 1, 1000)
        require_count("rest_runs", self.rest_runs, 0)
        require_count("held_runs", self.held_runs, 0)
        require_duration("away_duration", self.away_duration)
        require_number("away_weight", self.away_weight, 0.0, open_low=True)

    @property
    def total(self) -> float:
        """Of all runs together [s]."""
        away = self.rest_runs * self.away_duration + self.held_runs * (HELD + self.away_duration)
        return self.duration + away


def require_washout(washout: float, duration: float) -> None:
    """Raise unless 0 <= washout < duration [s]."""
    require_number("washout", washout, 0.0)
    if washout >= duration:
        raise InvalidArgumentError("washout", f"less than the duration of {duration:g} s", washout)


@dataclass(frozen=True)
class Lesson:
    """A stretch of teacher forcing: what is fed back, and what the readout is to say then.

    Signals are functions of the simulation's time, which is 0 where a lesson starts from rest.

    Attributes:
        outputs: times (T,) [s] -> (T, n_outputs).
        duration: washout included [s].
        washout: start of it that the regression leaves out [s].
        inputs: times (T,) [s] -> (T, n_inputs); None: no input.
        weight: of the squared errors, a number or times (T,) [s] -> (T,).
        from_rest: begin at total rest and time 0, and leave the simulation as it was.
        start: begin at this snapshot of the simulation, and leave it as it was.
        held: outputs (n_outputs,) that are fed back during the washout instead.
        noise_share: of the teaching's noise, a number or one for each output.
        own_share: s in [0, 1]: s y + (1 - s) y* + noise is fed back, y the body's own outputs.
    """

    outputs: Signal
    duration: float
    washout: float = 0.0
    inputs: Signal | None = None
    weight: float | Signal = 1.0
    from_rest: bool = False
    start: Array | None = None
    held: Sequence[float] | None = None
    noise_share: float | Sequence[float] = 1.0
    own_share: float = 0.0

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_washout(self.washout, self.duration)
        for share in np.atleast_1d(self.noise_share).tolist():
            require_number("noise_share", share, 0.0)
        require_number("own_share", self.own_share, 0.0, 1.0)
        if self.from_rest and self.start is not None:
            raise InvalidArgumentError("start", "None for a lesson from rest", "a snapshot")

    @property
    def elsewhere(self) -> bool:
        """Whether it begins where the simulation is not."""
        return self.from_rest or self.start is not None

    def begin(self, simulation: Reservoir) -> None:
        """Put a simulation where the lesson begins."""
        if self.from_rest:
            simulation.reset()
        if self.start is not None:
            simulation.restore(self.start)


class TeacherNoise:
    """White noise and slow noise, from its stationary start on, for some channels.

        e_k = noise n_k + x_k
        x_(k+1) = a x_k + drift sqrt(1 - a^2) m_k,   a = exp(-h / drift_time)

    n, m: independent and standard normal; x (units of the output) is a sampled Ornstein-Uhlenbeck
    process. White noise of 0.2 at steps of 1 ms hardly moves a body; slow noise of 0.03 over
    0.5 s has twenty times its power at the frequencies of a rhythm, where a free run goes astray.

    Args:
        teaching: noise, drift and drift_time.
        generator: of all that is drawn.
        channels: their number.
        timestep: h [s].
    """

    def __init__(
        self, teaching: Teaching, generator: np.random.Generator, channels: int, timestep: float
    ) -> None:
        self._generator, self._channels = generator, channels
        self._noise, self._drift = teaching.noise, teaching.drift
        self._decay = float(np.exp(-timestep / teaching.drift_time))
        if self._drift:
            self._last = self._decay * self._drift * generator.standard_normal((1, channels))

    def take(self, steps: int) -> Array:
        """The next (steps, channels)."""
        drawn = self._generator.standard_normal((steps, 1 + bool(self._drift), self._channels))
        found: Array = self._noise * drawn[:, 0]
        if self._drift:
            from scipy.signal import lfilter  # takes a second to import

            size = self._drift * np.sqrt(1.0 - self._decay**2)
            slow, self._last = lfilter(
                [size], [1.0, -self._decay], drawn[:, 1], axis=0, zi=self._last
            )
            found += slow
        return found
