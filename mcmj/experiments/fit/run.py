"""A readout of measured signals: trained on the first rows, tested on the last."""

import warnings

import numpy as np

from mcmj.core.readout import Readout
from mcmj.experiments.fit.config import Config
from mcmj.experiments.fit.recording import Recording, read_recording
from mcmj.experiments.fit.result import Result, Worth
from mcmj.learning.regression import Fit, Regression
from mcmj.metrics.capacity import processing_capacity
from mcmj.metrics.orbits import nrmse_std
from mcmj.targets.filter_tasks import delays
from mcmj.utils.errors import InvalidArgumentError, McmjWarning
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

SURELY = 5.0  # standard deviations of an autocorrelation of independent inputs


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Read the files, fit, test.

    Raises:
        InvalidArgumentError: a file that cannot be read or does not fit the others, too few rows,
            or a target that does not change.
    """
    signals = read_recording(config.signals, "signals")
    targets = _beside(signals, read_recording(config.targets, "targets"), "targets")
    x, y = signals.values[config.washout :], targets.values[config.washout :]
    train = _train_rows(config, x)
    still = np.flatnonzero(np.ptp(y[train:], axis=0) == 0.0)
    if still.size:
        wanted = "columns that change in the held-out rows"
        raise InvalidArgumentError("targets", wanted, targets.names[still[0]])
    fit = _fit(x[:train], y[:train], config)
    spectrum = _spectrum(x[:train])
    times = signals.times if signals.times is not None else targets.times
    rows = np.arange(float(len(signals.values))) if times is None else times
    result = Result(
        config, signals.names, targets.names, fit,
        times=rows[config.washout + train :], has_time=times is not None,
        outputs=_outputs(fit, x[train:]), wanted=y[train:],
        spectrum=spectrum, rank=_rank(spectrum, train),
        worth=None if config.inputs is None else _worth(config, signals, y, train),
    )  # fmt: skip
    on_steps(1)
    return result


def _train_rows(config: Config, x: Array) -> int:
    """Rows before the held-out ones."""
    train = len(x) - round(config.test_share * len(x))
    least = x.shape[1] + config.bias
    if train < least or len(x) - train < 2:
        wanted = f"at least {least} rows to train on and 2 to test on"
        raise InvalidArgumentError("signals", wanted, f"{train} and {len(x) - train}")
    return train


def _spectrum(x: Array) -> Array:
    """Standard deviations (n,) of signals (K, n) along their principal directions."""
    factor = np.linalg.qr(x - x.mean(axis=0), mode="r")
    found: Array = np.linalg.svd(factor, compute_uv=False) / np.sqrt(len(x))
    return found


def _rank(spectrum: Array, rows: int) -> int:
    return int((spectrum > spectrum[0] * rows * np.finfo(float).eps).sum())


def _beside(signals: Recording, other: Recording, argument: str) -> Recording:
    """The other recording, if it is of the same samples."""
    if len(other.values) != len(signals.values):
        wanted = f"{len(signals.values)} rows, as the signals have"
        raise InvalidArgumentError(argument, wanted, len(other.values))
    if signals.times is not None and other.times is not None:
        step = np.median(np.abs(np.diff(signals.times))) if len(signals.times) > 1 else 0.0
        apart = np.flatnonzero(np.abs(other.times - signals.times) > 0.5 * step)
        if apart.size:
            row = apart[0]
            raise InvalidArgumentError(
                argument, f"the signals' time {signals.times[row]:g} s in row {row + 1}",
                f"{other.times[row]:g} s",
            )  # fmt: skip
    return other


def _fit(x: Array, y: Array, config: Config) -> Fit:
    regression = Regression(bias=config.bias)
    regression.add(x, y)
    return regression.solve(config.ridge)


def _outputs(fit: Fit, x: Array) -> Array:
    return Readout.from_rows(fit.w_out, x.shape[1]).outputs(x)


def _worth(config: Config, signals: Recording, y: Array, train: int) -> Worth:
    inputs = _beside(signals, read_recording(str(config.inputs), "inputs"), "inputs")
    if inputs.values.shape[1] != 1 or np.ptp(inputs.values) == 0.0:
        raise InvalidArgumentError("inputs", "one column that changes", ", ".join(inputs.names))
    last = slice(config.washout + config.hold - 1, None, config.hold)
    states, shown = signals.values[last], _between_minus_1_and_1(inputs.values[last, 0])
    longest = max(config.max_delays)
    least = 2 * states.shape[1] + longest + 1
    if len(states) < least:
        wanted = f"at least {least} inputs for {states.shape[1]} signals and {longest} delays"
        raise InvalidArgumentError("inputs", wanted, len(states))
    return Worth(
        processing_capacity(states, shown, config.max_delays),
        _baseline(config, inputs.values, y, train),
        _checked_autocorrelation(shown, longest),
    )


def _between_minus_1_and_1(u: Array) -> Array:
    low, high = u.min(), u.max()
    found: Array = np.clip(2.0 * (u - low) / (high - low) - 1.0, -1.0, 1.0)
    return found


def _baseline(config: Config, u: Array, y: Array, train: int) -> float:
    """Held-out error of the same regression without the body: on inputs and their delays."""
    lags = delays(u, 1 + max(config.max_delays), config.hold)[config.washout :]
    fit = _fit(lags[:train], y[:train], config)
    return nrmse_std(_outputs(fit, lags[train:]), y[train:])


def _checked_autocorrelation(u: Array, longest: int) -> float:
    """The largest in size of inputs (K,) at delays of 1 .. longest; warns if it is no chance."""
    centred = u - u.mean()
    found = [
        float(centred[i:] @ centred[: len(u) - i] / (centred @ centred))
        for i in range(1, max(1, longest) + 1)
    ]
    largest = max(found, key=abs)
    if abs(largest) > SURELY / np.sqrt(len(u)):
        warnings.warn(
            f"inputs: the capacities are those of independent inputs; these repeat themselves "
            f"(autocorrelation {largest:.2f} at a delay of {1 + found.index(largest)}): "
            "see --hold",
            McmjWarning,
            stacklevel=2,
        )
    return largest
