"""Region of attraction: from where, and after which blows, the loop comes back to its orbit.

A copy has recovered if it is finite and its orbit error (`metrics.orbit_error`) over the last
part of the run is below a threshold. Its recovery time is `metrics.recovery_time` with the same
threshold: infinite too for a copy whose orbit is good in the mean but strays further at a place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mcmj.analysis.loops.loop_map import LoopMap
from mcmj.analysis.stability.cycle import Cycle
from mcmj.metrics import orbits
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array, require_number

BATCH = 64  # copies at a time: 64 MB of outputs a minute
SPARSE = 0.01  # between the outputs that errors are computed of [s]


@dataclass(frozen=True)
class Survey:
    """What became of B copies.

    Attributes:
        errors: (B,) orbit error of the last part; infinite where a copy blew up.
        times: (B,) recovery time [s]; infinite where the outputs do not stay within.
        threshold: largest orbit error of a recovery.
    """

    errors: Array
    times: Array
    threshold: float

    @property
    def recovered(self) -> npt.NDArray[np.bool_]:
        """(B,)."""
        return self.errors < self.threshold

    @property
    def blown(self) -> npt.NDArray[np.bool_]:
        """(B,) whose numbers overflowed: the integrator's failure, if not the body's."""
        return np.isinf(self.errors)

    @property
    def fraction(self) -> float:
        """Of the copies that recovered."""
        return float(self.recovered.mean())

    @property
    def median_time(self) -> float | None:
        """Median recovery time of those that recovered [s]; None if none did."""
        return float(np.median(self.times[self.recovered])) if self.recovered.any() else None

    def table(self, levels: Sequence[float]) -> list[dict[str, float | None]]:
        """Rates of each level; the copies are levels x (as many each)."""
        parts = zip(
            levels,
            np.split(self.errors, len(levels)),
            np.split(self.times, len(levels)),
            strict=True,
        )
        rows = [(level, Survey(errors, times, self.threshold)) for level, errors, times in parts]
        return [
            {
                "amplitude": level,
                "recovered": row.fraction,
                "blown_up": float(row.blown.mean()),
                "median_recovery_time": row.median_time,
            }
            for level, row in rows
        ]


def survey(
    loop: LoopMap,
    target: Target,
    states: Array,
    *,
    duration: float,
    threshold: float = 0.05,
) -> Survey:
    """Let copies (B, n) run free and see which come to the target's orbit, and when.

    Args:
        duration: of the free runs [s]; their last two periods must be on the orbit.

    Raises:
        InvalidArgumentError: a duration shorter than that.
    """
    window = 2 * target.period
    require_number("duration", duration, window)
    steps = round(duration / loop.timestep)
    runs = []
    for first in range(0, len(states), BATCH):
        batch = states[first : first + BATCH]
        finite = np.array([np.isfinite(z).all() for z in batch])  # not blown up before
        run = loop.run(np.where(finite[:, None], batch, 0.0), steps)
        alive = finite & run.alive
        runs.append(judge(run.outputs, alive, loop.timestep, target, window, threshold))
    return Survey(
        np.concatenate([s.errors for s in runs]), np.concatenate([s.times for s in runs]), threshold
    )


def judge(
    outputs: Array,
    alive: npt.NDArray[np.bool_],
    timestep: float,
    target: Target,
    window: float,
    threshold: float,
) -> Survey:
    """Errors and recovery times of outputs (B, T, n_outputs), whichever engine made them."""
    stride = max(1, round(SPARSE / timestep))
    sparse, spacing = outputs[:, ::stride], stride * timestep
    last = round(window / spacing)
    errors, times = np.full(len(outputs), np.inf), np.full(len(outputs), np.inf)
    for b in np.flatnonzero(alive):
        errors[b] = orbits.orbit_error(sparse[b, -last:], target)
        if errors[b] < threshold:
            times[b] = orbits.recovery_time(sparse[b], spacing, target, tolerance=threshold)
    return Survey(errors, times, threshold)


def on_cycle(loop: LoopMap, cycle: Cycle, count: int) -> Array:
    """States (count, n) spread evenly over the cycle, in time."""
    stride = max(1, round(cycle.period / loop.timestep / count))
    return loop.trail(cycle.state, stride, count)


def kicked(loop: LoopMap, cycle: Cycle, strengths: Array, generator: np.random.Generator) -> Array:
    """States (B, n) of the cycle, with velocity kicks in random directions.

    Args:
        strengths: (B,) RMS kick over the velocities, in units of their RMS speed (cycle.scale).
    """
    states, at = on_cycle(loop, cycle, len(strengths)), loop.velocities
    states = states[generator.permutation(len(states))]
    kicks = generator.standard_normal((len(states), at.stop - at.start))
    kicks /= np.sqrt((kicks**2).mean(axis=1, keepdims=True))
    states[:, at] += strengths[:, None] * cycle.scale[at] * kicks
    return states


def pushed(
    loop: LoopMap, states: Array, forces: Array | None, duration: float, *, refine: int = 1
) -> Array:
    """States (B, n) after constant forces (B, n_forces); NaN for those that blew up.

    Args:
        forces: horizontal on a body's nodes, or on the degrees of freedom; None: none.
        duration: of the forces [s].
        refine: steps that much smaller. Hard blows move nodes faster than the cubic dampers
            allow at 1 ms (`mcmj.simulation.stepsize.limit`): without it the integrator fails,
            not the body. A reservoir keeps the step of its model: 1.
    """
    fine = loop.refined(refine)
    rows = None if forces is None else forces[:, None]
    run = fine.run(states, round(duration / fine.timestep), forces=rows)
    return np.where(run.alive[:, None], run.states, np.nan)


def scaled_starts(
    loop: LoopMap, target: Target, scales: Array, phases: Array, *, duration: float
) -> Array:
    """States (B, n) that a teacher of `scales` (B,) times the target brings the loop to.

    Args:
        phases: (B,) of the target when the teacher lets go, in periods.
        duration: of the clean teacher forcing, from rest [s].
    """
    steps = round(duration / loop.timestep)
    before = (np.arange(steps) - steps) * loop.timestep
    states = []
    for first in range(0, len(scales), BATCH):
        some = slice(first, first + BATCH)
        teacher = np.stack([
            a * target.sample(before + phase * target.period)
            for a, phase in zip(scales[some], phases[some], strict=True)
        ])  # fmt: skip
        run = loop.run(np.tile(loop.rest, (len(teacher), 1)), offset=teacher, gate=0.0)
        states.append(np.where(run.alive[:, None], run.states, np.nan))
    return np.concatenate(states)
