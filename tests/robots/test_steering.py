"""A robot that one number steers: what it is told, what straightens its way, who leads it."""

from dataclasses import replace

import numpy as np
import pytest

from mcmj.experiments.soft_robot.config import SPATIAL, Config
from mcmj.experiments.soft_robot.steer import distances_in_order, figure_of_eight
from mcmj.robots.steering import (
    TELL,
    PointFollower,
    course_of_inputs,
    next_curvature,
    steering_bias,
    straight_curvature,
)
from mcmj.robots.trunk import draw_trunk, muscle_target
from mcmj.robots.trunk_walker import new_robot, poses, stand
from mcmj.robots.walk_metrics import Walk, headings
from mcmj.utils.errors import InvalidArgumentError


@pytest.fixture(scope="module")
def trunk():
    return draw_trunk(2, SPATIAL)


@pytest.mark.parametrize("steer", ["turn", "brake"])
def test_an_input_adds_its_bias_to_the_commands(trunk, steer):
    """As forces: those of a robot without input that is told the sum."""
    bias, ends = steering_bias(trunk, steer), []
    told = muscle_target(trunk, "trot", 16.0).sample(4e-4 * np.arange(500))
    for robot, given in (
        (new_robot(trunk, bias=bias), {"offset": told, "inputs": np.full((500, 1), 0.7)}),
        (new_robot(trunk), {"offset": told + 0.7 * bias}),
    ):
        robot.rollout(gate=0.0, record=(), **given)
        ends.append(robot.qpos)
    assert np.abs(ends[0] - ends[1]).max() < 1e-9
    assert np.abs(bias).max() > 0.004


def test_a_course_of_inputs_has_all_values_and_does_not_jump():
    times = np.arange(0.0, 400.0, 1e-3)
    for steer, low in (("turn", -1.0), ("brake", 0.0)):
        course = course_of_inputs(steer, 3, 2.0)(times)[:, 0]
        assert course.min() == low
        assert course.max() == 1.0
        assert np.abs(np.diff(course)).max() < 1.01e-3 * (1.0 - low) / 0.5
        assert course[0] == 0.0
        counts = np.histogram(course, 10)[0]
        assert counts.min() > len(times) / 30


def test_under_a_teacher_it_turns_as_told():
    trunk = draw_trunk(100, SPATIAL)
    turned = []
    for curvature in (-0.4, 0.4):
        robot, target = new_robot(trunk), muscle_target(trunk, "walk", 15.0, curvature=curvature)
        told = target.sample(robot.timestep * np.arange(7500))
        run = robot.rollout(offset=told, gate=0.0, record=("qpos",)).thinned(25)
        turned.append(np.degrees(np.ptp(headings(poses(trunk, run.get("qpos")))[[100, -1]])))
        turned[-1] *= np.sign(headings(poses(trunk, run.get("qpos")))[-1])
    assert turned[0] < -15.0
    assert turned[1] > 15.0


@pytest.mark.parametrize("rate", [
    lambda c: 60.0 * (c - 0.23),
    lambda c: 60.0 * (c + 0.41),
    lambda c: 9.0 * np.sign(c - 0.13) + 20.0 * c,  # it jumps: rolls to one side or the other
    lambda c: 300.0 * c**3 - 20.0 * c + 1.7,  # three roots
])  # fmt: skip
def test_curvatures_close_in_on_where_the_turning_changes_sign(rate):
    tried = {0.0: rate(0.0)}
    while len(tried) < 12:
        told = next_curvature(tried)
        tried[told] = rate(told)
    best = min(tried, key=lambda c: abs(tried[c]))
    assert rate(best - 0.01) < 0.0 < rate(best + 0.01) or rate(best + 0.01) < 0.0 < rate(
        best - 0.01
    )


def test_distances_from_points_are_taken_in_their_order():
    """A walk along two circles, a little wide: the crossing is its start, a point, and its end."""
    points, angle = figure_of_eight(4.0), np.linspace(0.0, 2 * np.pi, 401)
    left = np.column_stack([4.2 * np.sin(angle), 4.2 * (1 - np.cos(angle))])
    way = np.vstack([left, left[1:] * [1.0, -1.0], [[0.3, 0.0]]])
    operator = PointFollower(points, gain=1.0, near=0.1)
    trunk = np.zeros((1, len(way), 7))
    trunk[0, :, :2], trunk[0, :, 3] = way, 1.0
    for pose in trunk[0]:
        operator(pose)
    assert operator.done
    nothing = np.zeros((1, len(way), 1))
    walked = Walk(TELL * np.arange(len(way)), trunk, nothing, nothing, nothing[0], nothing[0])
    apart = distances_in_order(walked, operator)
    wanted = [np.linalg.norm(way - point, axis=1).min() for point in points]
    assert apart == pytest.approx(wanted, abs=1e-12)
    assert apart.max() == pytest.approx(0.4, abs=0.01)
    short = replace(walked, times=walked.times[:100], trunk=trunk[:, :100])
    operator.calls = operator.calls[:1]
    assert np.isfinite(distances_in_order(short, operator)).tolist() == [True] + 15 * [False]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"hold": 0.2}, "hold: expected a number in"),
        ({"told": (-1.0, 1.0)}, "told: expected values in order, 0 among them"),
        ({"told": (0.0, -1.0)}, "told: expected values in order, 0 among them"),
    ],
)
def test_inputs_that_cannot_be_measured_are_refused(changes, text):
    with pytest.raises(InvalidArgumentError, match=text):
        Config(**changes)


@pytest.mark.slow
def test_a_pace_that_circles_walks_straight_when_told_to():
    trunk, turned = draw_trunk(107, SPATIAL), []
    for curvature in (0.0, straight_curvature(trunk, "pace", 15.0)):
        robot = new_robot(trunk)
        stand(robot)
        target = muscle_target(trunk, "pace", 15.0, curvature=curvature)
        times = robot.timestep * np.arange(50_000)
        told = np.minimum(1.0, 2.0 * times)[:, None] * target.sample(times)
        run = robot.rollout(offset=told, gate=0.0, record=("qpos",)).thinned(2500)
        turned.append(np.degrees(np.diff(headings(poses(trunk, run.get("qpos")))[-6:]).mean()))
    assert abs(turned[0]) > 5.0
    assert abs(turned[1]) < 2.0


def test_an_operator_leads_a_point_that_turns_as_told_through_its_points():
    points = np.array([[3.0, 1.0], [5.0, 4.0], [2.0, 6.0]])
    operator, place, heading = PointFollower(points, gain=2.0, near=0.3), np.zeros(2), 0.0
    nearest = np.full(3, np.inf)
    for _ in range(400):
        half = heading / 2
        pose = np.array([*place, 0.0, np.cos(half), 0.0, 0.0, np.sin(half)])
        heading += 0.1 * np.clip(operator(pose), -1.0, 1.0)
        place = place + 0.05 * np.array([np.cos(heading), np.sin(heading)])
        nearest = np.minimum(nearest, np.linalg.norm(points - place, axis=1))
        if operator.done:
            break
    assert operator.done
    assert nearest.max() < 0.3


def test_a_point_that_cannot_be_reached_is_left_behind():
    """Straight ahead, whatever is said: points aside are passed, no circle is begun."""
    operator = PointFollower(np.array([[1.0, 0.0], [2.0, 1.5], [3.0, 0.0]]), gain=2.0, near=0.3)
    reached = []
    for x in np.arange(0.0, 3.5, 0.05):
        operator(np.array([x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
        reached.append(len(operator.calls))
    assert operator.done
    assert reached[int(1.5 / 0.05)] == 1
    assert reached[int(2.5 / 0.05)] == 2
