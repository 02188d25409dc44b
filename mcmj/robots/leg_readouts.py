"""What drives a robot's legs in one gait: linear readouts of the body's springs.

The readout of a gait (targets.gaits) says where each leg is, x_i, and closes the loop. A second
one, of the same springs, says how far each leg is lifted; nothing feeds it back:

    z_i = max(0, x_i') / max_t x_i'      x_i rises in swing, when the foot goes forwards

Both are scaled to the set points of the servos (quadruped.Stride), and to a body of the robot's
size and pace (robots.rescale).
"""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.core.readout import Readout, checked_readout
from mcmj.learning.regression import Regression
from mcmj.learning.teaching import synchronise
from mcmj.robots.quadruped import Stride
from mcmj.robots.rescale import SIZE, rescaled_readout
from mcmj.robots.walk_scene import INTEGRATOR
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array, require_number

SYNCHRONISE = 20.0  # s of teacher forcing before the closed loop
SETTLE = 20.0  # s of closed loop that teach nothing
THIN = 4  # one sample in so many is learned from
RIDGE_PER_ROW = 1e-6  # a length noise of 1 mm at springs of 10 m


@dataclass(frozen=True, eq=False)
class LegReadout:
    """One gait of a robot.

    Attributes:
        w_out: (L + 1, COMMANDS), readouts of what Stride.commands are; the first close the loop.
        start: (2, 2 n_free) positions [m] and velocities [m/s] of the free nodes' joints.
        stride: how the robot uses its legs.
        nrmse: Fit.train_nrmse of what was fitted.
    """

    w_out: Array
    start: Array
    stride: Stride
    nrmse: float = np.nan


def lift_of(outputs: Array) -> Array:
    """How far each leg is lifted (T, n), 0 to 1, when outputs (T, n) say where it is."""
    rate = np.gradient(outputs, axis=0)
    found: Array = np.clip(rate / rate.max(axis=0), 0.0, 1.0)
    return found


def teach_lift(
    body: Body,
    w_out: object,
    target: Target,
    *,
    stride: Stride | None = None,
    pace: float = 8.0,
    duration: float = 60.0,
    engine: str = "mujoco",
) -> LegReadout:
    """Fit the readout of the lift while the body runs a gait by itself, in closed loop.

    Args:
        body: in the units it was taught in, as all arguments.
        w_out: its readout for the gait.
        target: the gait, onto which the body is brought first.
        stride: how the robot uses the legs in it.
        pace: of the robot's body, as many times faster.
        duration: of the closed loop that is learned from [s].

    Raises:
        DivergenceError: the body blew up.
    """
    require_number("duration", duration, target.period)
    simulation = Simulation(body, integrator=INTEGRATOR, engine=engine)
    synchronise(simulation, target, SYNCHRONISE)
    simulation.set_readout(checked_readout(body, w_out))
    simulation.rollout(round(SETTLE / simulation.timestep), record=())
    run = simulation.rollout(round(duration / simulation.timestep))
    regression = Regression(bias=True)
    lifts = lift_of(run.get("outputs"))[::THIN]
    regression.add(run.get("lengths")[::THIN], lifts)
    fit = regression.solve(ridge=RIDGE_PER_ROW * len(lifts))
    stride, state = stride or Stride(), simulation.state
    swing, lift = (
        Readout.from_rows(rescaled_readout(body, w, size=SIZE), body.n_springs).rows
        for w in (simulation.w_out, fit.w_out)
    )
    bias = np.eye(body.n_springs + 1)[:, -1:]
    moved = (state.positions - body.positions)[body.free].ravel()
    start = SIZE * np.stack([moved, pace * state.velocities[body.free].ravel()])
    return LegReadout(stride.commands(swing, lift, bias), start, stride, fit.train_nrmse)
