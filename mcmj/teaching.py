"""Teacher forcing: the target is fed back in place of the outputs, and the readout is fitted."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mcmj.errors import InvalidArgumentError
from mcmj.readout import Fit, Regression
from mcmj.simulation import CHUNK, Simulation
from mcmj.streams import stream
from mcmj.targets import Target
from mcmj.validation import require_count, require_number


@dataclass(frozen=True)
class Teaching:
    """How a readout is taught.

    Attributes:
        duration: teacher forcing, washout included [s].
        washout: start of it that the regression leaves out [s].
        noise: standard deviation of the white noise on the fed-back teacher signal (units of
            the output); the regression target stays clean. Without it the free run drifts off.
        length_noise: standard deviation of white noise on the lengths the readout sees [m].
        ridge_per_row: ridge parameter over the number of rows; s^2 does what a length noise
            of s would, without randomness.
        bias: fit a constant too (the paper's readout has none).
        rest_runs: number of runs taught from total rest, without washout, beside the one
            above; they teach the body to swing up.
        rest_duration: of each of them [s]; the target starts at time 0 at full size.
        rest_weight: of their squared errors, against 1. Tiny, for a linear readout cannot
            serve both well: at 0.01 it already loses the cycle.
    """

    duration: float = 120.0
    washout: float = 20.0
    noise: float = 0.2
    length_noise: float = 0.0
    ridge_per_row: float = 0.0
    bias: bool = False
    rest_runs: int = 0
    rest_duration: float = 12.0
    rest_weight: float = 1e-3

    def __post_init__(self) -> None:
        require_number("duration", self.duration, 0.0, open_low=True)
        require_number("washout", self.washout, 0.0)
        if self.washout >= self.duration:
            raise InvalidArgumentError(
                "washout", f"less than the duration of {self.duration:g} s", self.washout
            )
        for name in ("noise", "length_noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        require_count("rest_runs", self.rest_runs, 0)
        for name in ("rest_duration", "rest_weight"):
            require_number(name, getattr(self, name), 0.0, open_low=True)


def teach(
    simulation: Simulation,
    target: Target,
    teaching: Teaching,
    seed: int,
    *,
    on_steps: Callable[[int], object] = lambda steps: None,
) -> Fit:
    """Teach a target to a body by teacher forcing, then close the loop with the readout.

    The teacher runs on from the simulation's time, so that afterwards the target's value at
    `simulation.time` is still what the body should do. Memory does not grow with duration.

    Args:
        simulation: the body to teach; afterwards its readout is the fitted one.
        seed: of the noise streams.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    noise, length_noise = stream(seed, "teacher_noise"), stream(seed, "length_noise")
    step = simulation.timestep
    total, washout = round(teaching.duration / step), round(teaching.washout / step)
    regression = Regression(bias=teaching.bias)
    if teaching.rest_runs:
        _teach_from_rest(simulation, target, teaching, seed, regression)
    start_step = round(simulation.time / step)
    for start in range(0, total, CHUNK):
        steps = np.arange(start, min(start + CHUNK, total))
        clean = target.sample((start_step + steps) * step)
        noisy = clean + teaching.noise * noise.standard_normal(clean.shape)
        rollout = simulation.rollout(offset=noisy, gate=0.0, record=("lengths",))
        lengths = rollout.get("lengths")
        if teaching.length_noise > 0:
            lengths = lengths + teaching.length_noise * length_noise.standard_normal(lengths.shape)
        learned = steps >= washout
        if learned.any():
            regression.add(lengths[learned], clean[learned])
        on_steps(len(steps))
    fit = regression.solve(ridge=teaching.ridge_per_row * (total - washout))
    simulation.set_readout(fit.w_out)
    return fit


def _teach_from_rest(
    simulation: Simulation, target: Target, teaching: Teaching, seed: int, regression: Regression
) -> None:
    """Fold in runs of teacher forcing from total rest; the simulation is left as it was."""
    noise, start = stream(seed, "rest_noise"), simulation.snapshot()
    step = simulation.timestep
    clean = target.sample(np.arange(round(teaching.rest_duration / step)) * step)
    for _ in range(teaching.rest_runs):
        noisy = clean + teaching.noise * noise.standard_normal(clean.shape)
        simulation.reset()
        rollout = simulation.rollout(offset=noisy, gate=0.0, record=("lengths",))
        regression.add(rollout.get("lengths"), clean, weight=teaching.rest_weight)
    simulation.restore(start)


def synchronise(simulation: Simulation, target: Target, duration: float) -> None:
    """Bring a body onto the target by clean teacher forcing, without learning."""
    step = simulation.timestep
    steps = round(simulation.time / step) + np.arange(round(duration / step))
    simulation.rollout(offset=target.sample(steps * step), gate=0.0, record=())
