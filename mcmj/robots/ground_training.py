"""Teaching on the ground: the legs' loads enter the body while its readouts are fitted.

A body that bears loads swings otherwise than one that was taught without them, and its old
readouts leave their orbit. So a teacher leads the whole robot over level ground: the servos
follow the target's commands, x_i* + noise is fed back, the loads u_i come in as they will, and
all readouts are fitted to the springs' lengths. What level ground does to the body is part of the
gait then; what other ground does otherwise is left to change the rhythm.
"""

import numpy as np

from mcmj.learning.lessons import Lesson, Teaching
from mcmj.learning.teaching import teach_lessons
from mcmj.robots.leg_readouts import THIN, LegReadout, lift_of
from mcmj.robots.quadruped import COMMANDS
from mcmj.robots.rescale import SIZE
from mcmj.robots.walker import Walker
from mcmj.targets.gaits import LEGS
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import require_number

WASHOUT = 20.0  # s of the body as it was taught, as all times here
RIDGE_PER_ROW = 1e-7 * SIZE**2  # of all readouts, as of the gaits without ground
TEACHING = Teaching(noise=0.2, ridge_per_row=RIDGE_PER_ROW, bias=True, every=THIN)
NOISY = np.arange(COMMANDS) < len(LEGS)  # what the body hears, not the servos


def teach_on_ground(
    walker: Walker, gait: LegReadout, target: Target, seed: int, *, duration: float = 100.0
) -> LegReadout:
    """Fit the readouts of a gait while the robot walks under a teacher.

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
    step = walker.timestep
    total = round((WASHOUT + duration) / (walker.pace * step))
    positions = target.sample(walker.pace * step * np.arange(total))
    told = gait.stride.commands(positions, lift_of(positions))
    lesson = Lesson(
        lambda times: told[np.rint(times / step).astype(int)], total * step,
        WASHOUT / walker.pace, noise_share=NOISY.astype(float).tolist(),
    )  # fmt: skip
    walker.start(gait)
    fit = teach_lessons(walker, [lesson], TEACHING, seed)
    return LegReadout(fit.w_out, walker.motion, gait.stride, fit.train_nrmse)
