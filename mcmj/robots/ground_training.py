"""Teaching on the ground: the legs' loads enter the body while its readouts are fitted.

A body that bears loads swings otherwise than one that was taught without them, and its old
readouts leave their orbit. So the teacher leads the whole robot over level ground: the legs
follow x_i* and z_i*, x_i* + noise is fed back, the loads u_i come in as they will, and both
readouts are fitted to the springs' lengths. What level ground does to the body is part of the
gait then; what other ground does otherwise is left to change the rhythm.
"""

import numpy as np

from mcmj.learning.regression import Fit, Regression
from mcmj.robots.leg_readouts import THIN, LegReadout, lift_of
from mcmj.robots.walker import Walker
from mcmj.simulation.simulation import CHUNK
from mcmj.targets.gaits import LEGS
from mcmj.targets.limit_cycles import Target
from mcmj.utils.seeds import stream
from mcmj.utils.validation import require_number

WASHOUT = 20.0  # s of the body as it was taught, as all times here
NOISE = 0.2  # standard deviation, on what is fed back
RIDGE_PER_ROW = 1e-7  # of both readouts, as of the gaits without ground


def teach_on_ground(
    walker: Walker, gait: LegReadout, target: Target, seed: int, *, duration: float = 100.0
) -> tuple[LegReadout, Fit]:
    """Fit both readouts of a gait while the robot walks under a teacher.

    Args:
        walker: one robot on the ground to teach on, with its coupling; it starts anew.
        gait: of a body that does not feel the ground: where to start, and the stride.
        target: x*.
        seed: of the noise.
        duration: of the teaching [s], after a washout.

    Raises:
        DivergenceError: it blew up.
    """
    require_number("duration", duration, target.period)
    step = walker.timestep * walker.pace
    first, total = round(WASHOUT / step), round((WASHOUT + duration) / step)
    rng, regression = stream(seed, "teacher_noise"), Regression(bias=True)
    positions = target.sample(step * np.arange(total))
    told = np.hstack([positions, lift_of(positions)])
    walker.start(gait)
    for begin in range(0, total, CHUNK):
        chunk = told[begin : begin + CHUNK]
        noise = NOISE * rng.standard_normal((len(chunk), len(LEGS)))
        lengths = walker.led(chunk[None], noise[None])[0]
        rows = slice(max(0, first - begin), None, THIN)
        regression.add(lengths[rows], chunk[rows])
    fit = regression.solve(ridge=RIDGE_PER_ROW * regression.weight)
    swing, lift = np.hsplit(fit.w_out, 2)
    return LegReadout(swing, lift, walker.body_state(), gait.stride), fit
