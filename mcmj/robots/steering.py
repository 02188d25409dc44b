"""One number steers a robot: it is added to the muscles' commands, and the readout stays as it is.

    command of muscle j = readout of the lengths + b_j u

b is the change of length that moves the feet, at u = 1, by so much: for "turn", fore feet to the
right, hind feet to the left, all a little to the right, and left feet up, which turns every gait to
the left; for "brake", all feet ahead, which slows it down. The gait that is taught does not depend
on u, but is taught under many u, or they would throw the loop out of its rhythm.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mcmj.metrics import orbits
from mcmj.robots.trunk import Trunk, changes_of_length, muscle_target
from mcmj.robots.trunk_walker import SAMPLE, has_fallen, new_robot, poses, stand, walk
from mcmj.robots.walk_metrics import Walk, fallen, headings, joined
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_names

# at u = 1 [m]: feet fore and hind apart, all to the right, left and right up and down; all ahead
TURN, BRAKE = (0.0375, 0.018, 0.015), 0.14
LOWEST = {"turn": -1.0, "brake": 0.0}  # of u, by what it does; the largest is 1
RAMP = 0.5  # s, from one value of u to the next, and in which a teacher begins
TELL = 0.1  # s, between an operator's commands
# how a way is straightened: walks of so long [s], so many at most; a curvature to try first [1/m],
# and the largest; straight enough [deg/s]
WALK, WALKS, FIRST, STEEPEST, STRAIGHT = 15.0, 10, 0.1, 0.5, 1.0


def steering_bias(trunk: Trunk, steer: str) -> Array:
    """b (n_muscles,) [m], of a robot in space.

    Raises:
        UnknownNameError: neither "turn" nor "brake".
    """
    require_names("steer", (steer,), LOWEST)
    ahead, left = np.sign((trunk.feet - trunk.feet.mean(axis=0))[:, :2].T)
    moved = np.zeros((1, *trunk.feet.shape))
    if steer == "turn":
        moved[0, :, 1] = -TURN[0] * ahead - TURN[1]
        moved[0, :, 2] = TURN[2] * left
    else:
        moved[0, :, 0] = BRAKE
    found: Array = changes_of_length(trunk, moved)[0]
    return found


def course_of_inputs(steer: str, seed: int, hold: float) -> Callable[[Array], Array]:
    """Random u (T, 1) at times (T,) [s], each held for so long [s], to learn from.

    Every third is at an end, where else hardly any is; they follow each other in RAMP seconds.
    """
    low = LOWEST[steer]
    values = stream(seed, "task_inputs").uniform(low, 1.0, 4096)
    values[::3] = np.where(values[::3] < (low + 1.0) / 2, low, 1.0)
    values = np.concatenate([[0.0], values])  # a robot begins as it stands

    def course(times: Array) -> Array:
        which = (times / hold).astype(int) % (len(values) - 1)
        share = np.minimum(1.0, np.mod(times, hold) / RAMP)
        found: Array = values[which] + share * (values[which + 1] - values[which])
        return found[:, None]

    return course


def straight_curvature(trunk: Trunk, gait: str, pace: float) -> float:
    """What to tell the feet [1/m], so that a robot walks straight ahead under a teacher.

    The legs of a random trunk do not pull alike. By bisection from how the robot turns in walks;
    the best one counts, for how it turns may jump: a pace rolls, to one side or the other.
    """
    robot, tried = new_robot(trunk), dict[float, float]()
    stand(robot)
    start, told = robot.snapshot(), 0.0
    while len(tried) < WALKS and told not in tried:
        robot.restore(start)
        tried[told] = _turning(robot, trunk, muscle_target(trunk, gait, pace, curvature=told))
        if abs(tried[told]) < STRAIGHT:
            break
        told = float(np.clip(next_curvature(tried), -STEEPEST, STEEPEST))
    return min(tried, key=lambda told: abs(tried[told]))


def next_curvature(tried: dict[float, float]) -> float:
    """Which one to try next, from how a robot turns under those tried.

    Between the two neighbours that turn least, one to each side; beyond all, if none do so.
    """
    known = sorted(tried.items())
    pairs = [
        (abs(rate) + abs(other), (one + two) / 2)
        for (one, rate), (two, other) in pairwise(known)
        if rate * other < 0.0
    ]
    if pairs:
        return min(pairs)[1]
    (low, rate), (high, _) = known[0], known[-1]
    reach = max(FIRST, high - low)
    return low - reach if rate > 0.0 else high + reach


def _turning(robot: Reservoir, trunk: Trunk, target: Target) -> float:
    """Of a robot under a teacher, to the left [deg/s], when it has settled; inf if it falls."""
    step, every = robot.timestep, round(SAMPLE / robot.timestep)
    times = step * np.arange(round(WALK / step))
    told = np.minimum(1.0, times / RAMP)[:, None] * target.sample(times)
    try:
        run = robot.rollout(offset=told, gate=0.0, record=("qpos",)).thinned(every)
    except DivergenceError:
        return np.inf
    pose = poses(trunk, run.get("qpos"))
    if fallen(pose, trunk.settings.leg).any():
        return np.inf
    heading = headings(pose)[len(run) // 2 :]
    return float(np.degrees(heading[-1] - heading[0])) / (SAMPLE * (len(heading) - 1))


def steered_error(
    robot: Reservoir, trunk: Trunk, target: Target, values: Sequence[float], duration: float
) -> float:
    """Mean orbit error of a free run at constant inputs, one after the other; inf if it falls."""
    failed, errors, steps = has_fallen(trunk), [], round(duration / robot.timestep)
    try:
        for u in values:
            run = robot.rollout(steps, np.full((steps, 1), u), record=("outputs", "qpos"))
            if failed(run):
                return np.inf
            errors.append(orbits.orbit_error(run.get("outputs")[steps // 2 :], target))
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
    """A walk whose input an operator sets, until it falls; and the inputs (n,), one in TELL s.

    Args:
        duration: at most [s].
        operator: u from the pose (7,) of the trunk.
        done: whether that was all.

    Raises:
        DivergenceError: the robot blew up.
    """
    parts, told = list[Walk](), list[float]()
    while len(told) * TELL < duration and not done():
        pose = poses(trunk, robot.qpos)
        if fallen(pose, trunk.settings.leg):
            break
        u = operator(pose)
        told.append(float(np.clip(u, -1.0, 1.0)))
        parts.append(walk(robot, trunk, TELL, told=told[-1]))
    return joined(parts), np.array(told)


class PointFollower:
    """An operator: u in proportion to the angle from the heading to the next point.

    Args:
        points: (n, 2) places to go through, one after the other [m].
        gain: u per radian.
        near: a point is reached within this distance [m], or left behind; the last one must be
            left behind.
        straight: u at which the robot walks straight ahead.

    Attributes:
        calls: number of commands before each point that was reached or left behind.
    """

    def __init__(self, points: Array, gain: float, near: float, straight: float = 0.0) -> None:
        self.points, self.gain, self.near, self.straight = points, gain, near, straight
        self.calls: list[int] = []
        self._called, self._along = 0, np.gradient(points, axis=0)

    @property
    def done(self) -> bool:
        """Whether all points are reached, or left behind."""
        return len(self.calls) == len(self.points)

    def __call__(self, pose: Array) -> float:
        """The next input."""
        while not self.done and self._passed(pose[:2]):
            self.calls.append(self._called)
        self._called += 1
        apart = self.points[min(len(self.calls), len(self.points) - 1)] - pose[:2]
        turn = np.arctan2(apart[1], apart[0]) - headings(pose[None])[0]
        return self.straight + self.gain * float(np.mod(turn + np.pi, 2 * np.pi) - np.pi)

    def _passed(self, place: Array) -> bool:
        k = len(self.calls)
        apart = self.points[k] - place
        reached = np.hypot(*apart) < self.near and k < len(self.points) - 1
        return bool(reached or apart @ self._along[k] < 0.0)
