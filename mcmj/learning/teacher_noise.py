"""Noise on what a teacher feeds back: what a body learns to correct."""

import numpy as np
from scipy.signal import lfilter

from mcmj.learning.lessons import Teaching
from mcmj.utils.validation import Array


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
            size = self._drift * np.sqrt(1.0 - self._decay**2)
            slow, self._last = lfilter(
                [size], [1.0, -self._decay], drawn[:, 1], axis=0, zi=self._last
            )
            found += slow
        return found
