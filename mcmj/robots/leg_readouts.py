"""What drives a robot's legs in one gait: linear readouts of the body's springs.

The readout of a gait (targets.gaits) says where each leg is, and closes the loop. A second one,
of the same springs, says how far each leg is lifted; nothing feeds it back:

    z_i = max(0, x_i') / max_t x_i'      x_i rises in swing, when the foot goes forwards
"""

from dataclasses import dataclass, field

import numpy as np

from mcmj.core.body import Body
from mcmj.core.readout import checked_readout
from mcmj.core.trajectory import State
from mcmj.learning.regression import Fit, Regression
from mcmj.learning.teaching import synchronise
from mcmj.robots.quadruped import Stride
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array, require_number

SYNCHRONISE = 20.0  # s of teacher forcing before the closed loop
SETTLE = 20.0  # s of closed loop that teach nothing
THIN = 4  # one sample in so many is learned from
RIDGE_PER_ROW = 1e-6  # a length noise of 1 mm at springs of 10 m


@dataclass(frozen=True, eq=False)
class LegReadout:
    """One gait of a body.

    Attributes:
        swing: (L, n_legs) or (L + 1, n_legs), the readout that closes the loop.
        lift: likewise; not fed back.
        start: a state of the body in this gait.
        stride: scale and offset of both, as the robot uses them.
    """

    swing: Array
    lift: Array
    start: State
    stride: Stride = field(default_factory=Stride)


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
    duration: float = 60.0,
    engine: str = "mujoco",
) -> tuple[LegReadout, Fit]:
    """Fit the readout of the lift while the body runs a gait by itself, in closed loop.

    Args:
        body: in the units it was taught in.
        w_out: its readout for the gait.
        target: the gait, onto which the body is brought first.
        stride: how the robot uses the legs in it.
        duration: of the closed loop that is learned from [s].

    Raises:
        DivergenceError: the body blew up.
    """
    require_number("duration", duration, target.period)
    swing = checked_readout(body, w_out)
    simulation = Simulation(body, engine=engine)
    synchronise(simulation, target, SYNCHRONISE)
    simulation.set_readout(swing)
    simulation.rollout(round(SETTLE / simulation.timestep), record=())
    run = simulation.rollout(round(duration / simulation.timestep))
    regression = Regression(bias=True)
    lifts = lift_of(run.get("outputs"))[::THIN]
    regression.add(run.get("lengths")[::THIN], lifts)
    fit = regression.solve(ridge=RIDGE_PER_ROW * len(lifts))
    return LegReadout(swing, fit.w_out, simulation.state, stride or Stride()), fit
