"""What the closed loop costs beside a bare mj_step loop."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.simulation.simulation import Simulation
from mcmj.utils.timing import interleaved_seconds, median_ratio
from mcmj.utils.validation import Array

STEPS = 4000
REPEATS = 7


def closed_loop_cost(body: Body, w_out: Array, stepping: Mapping[str, Any]) -> tuple[float, float]:
    """Steps a second in closed loop with lengths and outputs recorded, and its cost ratio.

    The ratio is the median over REPEATS of the time for STEPS control steps through
    Simulation.rollout, over the time of as many bare mj_step of the same model from the same
    state with the loop open, measured in turns.

    Args:
        stepping: arguments of the Simulation; the engine is MuJoCo.
    """
    simulation = Simulation(body, w_out=w_out, **{**stepping, "engine": "mujoco"})
    bare, free = mujoco.MjData(simulation.model), body.free

    def step_bare() -> None:
        state = simulation.state
        bare.qpos[:] = (state.positions - body.positions)[free].ravel()
        bare.qvel[:] = state.velocities[free].ravel()
        mujoco.mj_step(simulation.model, bare, nstep=STEPS)

    seconds = interleaved_seconds(
        {"closed": lambda: simulation.rollout(STEPS), "bare": step_bare}, REPEATS
    )
    speed = STEPS / float(np.median(seconds["closed"]))
    return speed, median_ratio(seconds, "closed", "bare")
