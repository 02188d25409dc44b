"""How well a readout runs the loop, from starts that its teaching has not seen."""

from collections.abc import Sequence

import numpy as np

from mcmj.learning.lessons import Teaching
from mcmj.metrics.orbits import orbit_error
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count


def held_out_starts(
    simulation: Reservoir, target: Target, teaching: Teaching, seed: int, count: int
) -> list[Array]:
    """Snapshots from which to close the loop: other noise than in teaching, other phases.

    The body is forced from rest with the teaching's noise, drawn from a stream of its own, for
    the washout and then on; the starts are a period and 1 / count of one apart.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    require_count("count", count, 1)
    noise, step = stream(seed, "held_out_noise"), simulation.timestep
    simulation.reset()
    starts = []
    apart = (1.0 + 1.0 / count) * target.period
    for k in range(count):
        seconds = max(teaching.washout, target.period) if k == 0 else apart
        steps = round(simulation.time / step) + np.arange(round(seconds / step))
        clean = target.sample(steps * step)
        noisy = clean + teaching.noise * noise.standard_normal(clean.shape)
        simulation.rollout(offset=noisy, gate=0.0, record=())
        starts.append(simulation.snapshot())
    return starts


def closed_loop_errors(
    simulation: Reservoir,
    w_out: Array,
    starts: Sequence[Array],
    target: Target,
    *,
    free_run: float,
    window: float,
) -> Array:
    """Orbit errors (starts,) of the last `window` seconds of free runs; infinite if it blew up.

    The simulation keeps the readout.
    """
    simulation.set_readout(w_out)
    total, last = (round(s / simulation.timestep) for s in (free_run, window))
    errors = np.full(len(starts), np.inf)
    for k, start in enumerate(starts):
        simulation.restore(start)
        try:
            outputs = simulation.rollout(total, record=("outputs",)).get("outputs")
        except DivergenceError:
            continue
        errors[k] = orbit_error(outputs[-last:], target)
    return errors
