"""One number steers a robot: it enters the trunk as forces, and the readout stays as it is.

What is taught depends on the input u, of which the readout knows only by what the forces do to
the springs (trunk.TrunkSettings.steer):

    turn    the feet go along circles, curvature 0.4 u [1/m] to the left
    speed   strides are 0.8 + 0.4 u of the swing of the settings

besides the curvature with which the robot walks straight ahead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mcmj.metrics import orbits
from mcmj.robots.trunk import Trunk, muscle_target
from mcmj.robots.trunk_walker import SAMPLE, has_fallen, new_robot, poses, stand, walk
from mcmj.robots.walk_metrics import Walk, headings, joined
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

LEVELS = (-1.0, 0.0, 1.0)  # of u, whose cycles are known; between them they are interpolated
RAMP = 0.5  # s, from one value of u to the next
TELL = 0.1  # s, between an operator's commands
# how a way is straightened: short walks [s], so many; turning over curvature, as a first guess
# [deg m/s]; the largest curvature [1/m]
WALK, WALKS, SLOPE, STEEPEST = 6.0, 4, 60.0, 0.5


def steered_target(
    trunk: Trunk, gait: str, pace: float, steer: str, u: float, straight: float
) -> Target:
    """The muscles' changes of length at an input.

    Args:
        straight: the curvature with which the robot walks straight ahead [1/m].
    """
    if steer == "speed":
        return muscle_target(trunk, gait, pace, stride=0.8 + 0.4 * u, curvature=straight)
    return muscle_target(trunk, gait, pace, curvature=straight + 0.4 * u)


def straight_curvature(trunk: Trunk, gait: str, pace: float) -> float:
    """What to tell the feet [1/m], so that a robot walks straight ahead under a teacher.

    The legs of a random trunk do not pull alike. By the secant method from how the robot turns in
    short walks; the best one counts.
    """
    robot, tried = new_robot(trunk), dict[float, float]()
    stand(robot)
    start, told = robot.snapshot(), 0.0
    for _ in range(WALKS):
        robot.restore(start)
        target = muscle_target(trunk, gait, pace, curvature=told)
        tried[told] = _turning(robot, trunk, target)
        (one, rate), (other, other_rate) = (list(tried.items())[-2:] * 2)[:2]
        slope = (other_rate - rate) / (other - one) if other != one else SLOPE
        told -= tried[told] / max(slope, SLOPE / 4)
        told = float(np.clip(told, -STEEPEST, STEEPEST))
        if told in tried:
            break
    return min(tried, key=lambda told: abs(tried[told]))


def _turning(robot: Reservoir, trunk: Trunk, target: Target) -> float:
    """Of a robot under a teacher, to the left [deg/s]; infinite if it blows up."""
    step, every = robot.timestep, round(SAMPLE / robot.timestep)
    times = step * np.arange(round(WALK / step))
    told = np.minimum(1.0, times / RAMP)[:, None] * target.sample(times)
    run = robot.rollout(offset=told, gate=0.0, record=("qpos",)).thinned(every)
    heading = headings(poses(trunk, run.get("qpos")))[len(run) // 3 :]
    return float(np.degrees(heading[-1] - heading[0])) / (SAMPLE * (len(heading) - 1))


@dataclass(frozen=True)
class Steered:
    """A gait that an input changes, and a course of random values of it to learn from.

    Attributes:
        cycles: by u, those of LEVELS.
        target: what is taught along the course, periodic as the course is.
        inputs: u (T, 1) along the course at times (T,) [s].
    """

    cycles: dict[float, Target]
    target: Target
    inputs: Callable[[Array], Array]

    def cycle(self, u: float) -> Target:
        """The cycle at a constant u."""
        first = self.cycles[LEVELS[0]]
        return Target(first.name, first.period, lambda times: _between(self.cycles, times, u))


def steered_gait(
    trunk: Trunk,
    gait: str,
    pace: float,
    straight: float,
    seed: int,
    *,
    duration: float,
    hold: float,
) -> Steered:
    """A gait and a course for a robot that has an input.

    Args:
        straight: the curvature with which it walks straight ahead [1/m].
        seed: of the course.
        duration, hold: of the course, and of each value in it [s], in whole strides.
    """
    steer = trunk.settings.steer
    cycles = {u: steered_target(trunk, gait, pace, steer, u, straight) for u in LEVELS}
    period = cycles[0.0].period
    hold = period * max(1, round(hold / period))
    values = stream(seed, "task_inputs").uniform(-1.0, 1.0, max(2, round(duration / hold)))
    values[::3] = np.sign(values[::3])  # the ends, which a uniform course hardly sees
    starts = hold * np.arange(len(values) + 1)

    def course(times: Array) -> Array:
        at = np.mod(times, starts[-1])
        which = np.minimum((at / hold).astype(int), len(values) - 1)
        share = np.minimum(1.0, (at - starts[which]) / RAMP)
        found: Array = values[which - 1] + share * (values[which] - values[which - 1])
        return found

    target = Target(gait, float(starts[-1]), lambda t: _between(cycles, t, course(np.asarray(t))))
    return Steered(cycles, target, lambda times: course(times)[:, None])


def _between(cycles: dict[float, Target], times: Array, u: npt.ArrayLike) -> Array:
    """Linear in u between the levels (T, n_outputs)."""
    low, middle, high = (cycles[level].sample(times) for level in LEVELS)
    share = np.broadcast_to(u, np.shape(times))[:, None]
    found: Array = middle + np.where(share > 0, share * (high - middle), -share * (low - middle))
    return found


def steered_error(
    robot: Reservoir, trunk: Trunk, steered: Steered, values: Sequence[float], duration: float
) -> float:
    """Mean orbit error of a free run at constant inputs, one after the other; inf if it falls."""
    failed, errors, steps = has_fallen(trunk), [], round(duration / robot.timestep)
    try:
        for u in values:
            run = robot.rollout(steps, np.full((steps, 1), u), record=("outputs", "qpos"))
            if failed(run):
                return np.inf
            errors.append(orbits.orbit_error(run.get("outputs")[steps // 2 :], steered.cycle(u)))
    except DivergenceError:
        return np.inf
    return float(np.mean(errors))


def operate(
    robot: Reservoir,
    trunk: Trunk,
    duration: float,
    operator: Callable[[Array], float],
    done: Callable[[], bool],
) -> tuple[Walk, Array]:
    """A walk whose input an operator sets, and the inputs (n,), one in TELL seconds.

    Args:
        duration: at most [s].
        operator: u from the pose (7,) of the trunk.
        done: whether that was all.

    Raises:
        DivergenceError: the robot blew up.
    """
    parts, told = list[Walk](), list[float]()
    while len(told) * TELL < duration and not done():
        u = operator(poses(trunk, robot.qpos))
        told.append(float(np.clip(u, -1.0, 1.0)))
        parts.append(walk(robot, trunk, TELL, told=told[-1]))
    return joined(parts), np.array(told)


class PointFollower:
    """An operator: u in proportion to the angle from the heading to the next point.

    Args:
        points: (n, 2) places to go through, one after the other [m].
        gain: u per radian.
        near: a point is reached within this distance [m].
        straight: u at which the robot walks straight ahead.
    """

    def __init__(self, points: Array, gain: float, near: float, straight: float = 0.0) -> None:
        self.points, self.gain, self.near, self.straight = points, gain, near, straight
        self.reached = 0

    @property
    def done(self) -> bool:
        """Whether all points are reached."""
        return self.reached == len(self.points)

    def __call__(self, pose: Array) -> float:
        """The next input."""
        apart = self.points[min(self.reached, len(self.points) - 1)] - pose[:2]
        if np.hypot(*apart) < self.near and not self.done:
            self.reached += 1
        turn = np.arctan2(apart[1], apart[0]) - headings(pose[None])[0]
        return self.straight + self.gain * float(np.mod(turn + np.pi, 2 * np.pi) - np.pi)
