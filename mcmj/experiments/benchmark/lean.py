"""What the closed loop costs beside MuJoCo's own step of the body's file: tendons, Euler."""

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import random_body
from mcmj.experiments.benchmark.config import Config, small_readout
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.simulation import Simulation
from mcmj.utils.timing import interleaved_seconds, median_ratio

SIZES = (25, 100, 300)  # nodes
KICK = 0.05  # of the nodes [m/s]


def lean_costs(config: Config, body: Body) -> dict[str, object]:
    """Closed loop by default, lengths and outputs recorded, over Euler's mj_step of the file.

    By the number of nodes; both from the same kick, so that both make the same motion.
    """
    return {"lean_ratio": {str(nodes): _lean_ratio(config, nodes) for nodes in SIZES}}


def _lean_ratio(config: Config, nodes: int) -> float:
    body = random_body(config.seed, nodes)
    steps = max(10, config.steps * 30 // nodes)
    closed = Simulation(body, w_out=small_readout(body))
    model = load_model(to_mjcf(body, integrator="Euler"))
    kick = KICK * np.random.default_rng(config.seed).standard_normal(body.positions.shape)
    data = mujoco.MjData(model)

    def bare() -> None:
        mujoco.mj_resetData(model, data)
        data.qvel[:] = kick[body.free].ravel()
        mujoco.mj_step(model, data, nstep=steps)

    def loop() -> None:
        closed.reset()
        closed.set_state(velocities=kick)
        closed.rollout(steps)

    seconds = interleaved_seconds({"closed": loop, "bare": bare}, config.repeats)
    return median_ratio(seconds, "closed", "bare")
