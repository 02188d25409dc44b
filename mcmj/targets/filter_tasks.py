"""Filters to learn: an input, and what a fading or a persistent memory makes of it.

The toolbox's are sampled at 1 ms; those of reservoir computing come in symbols that a body is
shown for a while each (`hold`), because a body has a time scale of its own.
"""

from dataclasses import dataclass

import numpy as np

from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.validation import Array, require_count, require_number

FREQUENCIES = (2.11, 3.73, 4.33)  # Hz, of the authors' toolbox
SUPPORT = 0.2  # s, of the Gaussian kernel


@dataclass(frozen=True)
class FilterTask:
    """Inputs (M, n_inputs) and targets (M, n_outputs), one row a symbol.

    Attributes:
        name: for files and figures.
        inputs, targets: what is shown, and what is wanted while it is.
        tap_spacing: symbols between the delays that a no-body baseline is given.
    """

    name: str
    inputs: Array
    targets: Array
    tap_spacing: int = 1

    def __post_init__(self) -> None:
        if len(self.inputs) != len(self.targets):
            raise InvalidArgumentError("targets", f"{len(self.inputs)} rows", len(self.targets))


def sines(steps: int, timestep: float) -> Array:
    """sin(2 pi f1 t) sin(2 pi f2 t) sin(2 pi f3 t), (T,), the toolbox's input."""
    times = np.arange(steps) * timestep
    found: Array = np.prod([np.sin(2 * np.pi * f * times) for f in FREQUENCIES], axis=0)
    return found


def smooth_noise(
    rng: np.random.Generator, steps: int, timestep: float, time: float = 0.05
) -> Array:
    """White noise through two first-order low-passes of that time [s]: (T, 1), of variance 1."""
    white = rng.standard_normal((steps + round(20 * time / timestep), 1))
    smooth = low_pass(low_pass(white, timestep, time), timestep, time)[-steps:]
    found: Array = smooth / smooth.std()
    return found


def gaussian_kernel(timestep: float) -> Array:
    """h(tau) = exp(-(tau - 0.1 s)^2 / 2 (0.05 s)^2) at 0 <= tau < 0.2 s, times sqrt(timestep).

    Its square is the toolbox's two-dimensional kernel: a sum over both arguments.
    """
    taus = np.arange(round(SUPPORT / timestep)) * timestep
    found: Array = np.sqrt(timestep) * np.exp(-((taus - 0.1) ** 2) / (2 * 0.05**2))
    return found


def volterra(steps: int, timestep: float = 1e-3) -> FilterTask:
    """y(t) = integral of h2(a, b) u(t - a) u(t - b), h2 a Gaussian, u a product of sines.

    The kernel (mu = 0.1 s, sigma = 0.05 s, support 0.2 s) is h(a) h(b), so that y is the square
    of a linear filter (Hauser et al. 2011; the toolbox's make_Volterra_data). Inputs are scaled
    by 0.2, targets to zero mean and unit variance, both as there.
    """
    wave = sines(steps, timestep)
    past = np.convolve(wave, gaussian_kernel(timestep))[:steps]
    return FilterTask("volterra", 0.2 * wave[:, None], _standard(past**2), tap_spacing=7)


def toolbox_narma(steps: int, timestep: float = 1e-3) -> FilterTask:
    """The toolbox's NARMA, one recursion a millisecond, of a product of sines u.

        y_k = 0.3 y_(k-1) + 0.05 y_(k-1) sum_(i=1..10) y_(k-i) + 1.5 u_(k-10) u_(k-1) + 0.1

    u is scaled by 0.1 for the recursion; then both are brought to zero mean and unit variance,
    as in make_NARMA_data.
    """
    wave = 0.1 * sines(steps, timestep)
    wave[:10] = 0.0
    return FilterTask("toolbox_narma", _standard(wave), _standard(_narma(wave, lag=1)))


def narma10(rng: np.random.Generator, symbols: int) -> FilterTask:
    """NARMA-10 (Atiya and Parlos 2000), u_k uniform in [0, 0.5].

        y_(k+1) = 0.3 y_k + 0.05 y_k sum_(i=0..9) y_(k-i) + 1.5 u_(k-9) u_k + 0.1

    The input that is shown is 4 u - 1, uniform in [-1, 1]; row k has u_k and y_(k+1).

    Raises:
        DivergenceError: the recursion blew up, which it does for some inputs; draw others.
    """
    require_count("symbols", symbols, 20)
    u = rng.uniform(0.0, 0.5, symbols)
    return FilterTask("narma10", 4 * u[:, None] - 1, _narma(u, lag=0)[:, None])


def delayed_recall(inputs: Array, delay: int) -> FilterTask:
    """u_(k-delay) of inputs (M, n_inputs); 0 before the first symbol."""
    require_count("delay", delay, 0)
    wanted = np.vstack([np.zeros((delay, inputs.shape[1])), inputs])[: len(inputs)]
    return FilterTask("delayed_recall", inputs, wanted)


def switch(
    rng: np.random.Generator,
    steps: int,
    timestep: float,
    *,
    pulse: float,
    gaps: tuple[float, float],
) -> FilterTask:
    """Analog state switching: the target is the sign of the last pulse, however long ago.

    One input is 0 but for pulses of +1 or -1, `pulse` seconds long, after pauses that are
    uniform in `gaps` [s]. The target goes to +1 or -1 through a low-pass of half a pulse.
    """
    require_number("pulse", pulse, 0.0, open_low=True)
    u, y = np.zeros((steps, 1)), np.empty((steps, 1))
    width, first, sign = round(pulse / timestep), 0, 1.0
    while first < steps:
        u[first : first + width], y[first:] = sign, sign
        first += width + round(rng.uniform(*gaps) / timestep)
        sign = rng.choice([-1.0, 1.0])
    return FilterTask("switch", u, low_pass(y, timestep, pulse / 2))


def low_pass(values: Array, timestep: float, time: float) -> Array:
    """z' = (values - z) / time, from 0, for values (T, n)."""
    from scipy.signal import lfilter  # takes a second to import

    keep = np.exp(-timestep / time)
    found: Array = lfilter([1 - keep], [1, -keep], values, axis=0)
    return found


def delays(inputs: Array, taps: int, spacing: int = 1) -> Array:
    """(M, taps): the first input now, `spacing` symbols ago, and so on; 0 before the first."""
    padded = np.concatenate([np.zeros((taps - 1) * spacing), inputs[:, 0]])
    count = len(inputs)
    starts = [(taps - 1 - i) * spacing for i in range(taps)]
    return np.column_stack([padded[start : start + count] for start in starts])


def _narma(u: Array, *, lag: int) -> Array:
    """y where row k has y_(k+1-lag) of the standard recursion; it starts with 0."""
    y = np.zeros(len(u) + 1)
    for k in range(9, len(u)):
        y[k + 1] = 0.3 * y[k] + 0.05 * y[k] * y[k - 9 : k + 1].sum() + 1.5 * u[k - 9] * u[k] + 0.1
    if not np.isfinite(y).all() or np.abs(y).max() > 10.0:
        raise DivergenceError("the NARMA recursion blew up", time=np.nan, steps_done=0)
    return y[1 - lag : len(y) - lag]


def _standard(values: Array) -> Array:
    found: Array = ((values - values.mean()) / values.std())[:, None]
    return found
