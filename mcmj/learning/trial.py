"""A trial: a free run in closed loop, judged by its last half."""

from collections.abc import Callable

import numpy as np

from mcmj.core.trajectory import Trajectory
from mcmj.metrics import orbits
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps

Failed = Callable[[Trajectory], bool]


def trial_error(
    simulation: Reservoir,
    target: Target,
    duration: float,
    failed: Failed | None = None,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> float:
    """Orbit error of the outputs in the last half of a free run; infinite if it fails.

    Args:
        duration: [s].
        failed: asked of every part of the run, whose outputs and qpos (of a body: positions) are
            recorded; a run that blows up has failed too.
        on_steps: called with the number of steps done after every part, for progress bars.
    """
    place = "positions" if isinstance(simulation, Simulation) else "qpos"
    record = ("outputs", place) if failed else ("outputs",)
    steps, kept, done = round(duration / simulation.timestep), [], 0
    try:
        for part in simulation.stream(steps, record=record):
            if failed is not None and failed(part):
                return np.inf
            done += len(part)
            if done > steps // 2:
                kept.append(part.get("outputs"))
            on_steps(len(part))
    except DivergenceError:
        return np.inf
    return orbits.orbit_error(np.concatenate(kept)[-(steps - steps // 2) :], target)
