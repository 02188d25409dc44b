"""A soft robot in space: its mechanics against symmetry, conservation and geometry."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mcmj.core.body import Body
from mcmj.experiments.soft_robot.config import SPATIAL, Config
from mcmj.experiments.soft_robot.economy import VARIED, designed
from mcmj.robots.energy import energy_balance
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import Trunk, draw_trunk, muscle_lengths, muscle_target
from mcmj.robots.trunk_walker import heading_ahead, new_robot, poses, stand, walk
from mcmj.robots.walk_metrics import headings
from mcmj.targets.gaits import LEGS

MIRROR = np.array([1.0, -1.0, 1.0])
OTHER_SIDE = [1, 0, 3, 2]  # legs


@pytest.fixture(scope="module")
def trunk():
    return draw_trunk(2, SPATIAL)


@pytest.fixture(scope="module")
def lively(trunk):
    rng = np.random.default_rng(1)
    return 0.3 * rng.normal(size=(trunk.n_sensed + 1, trunk.n_muscles))


def nodes_of(trunk, qpos):
    return trunk.body.positions + qpos.reshape(*qpos.shape[:-1], -1, 3)


def mirrored(trunk):
    """Left and right exchanged; muscles keep their legs' names."""
    body, n = trunk.body, trunk.settings.nodes
    positions = body.positions * MIRROR
    positions[n:] = positions[n:][OTHER_SIDE]
    springs = body.springs.copy()
    muscles = springs[trunk.n_sensed :].reshape(4, 3, 2)
    springs[trunk.n_sensed :, 0] = muscles[OTHER_SIDE, :, 0].ravel()
    given = {name: getattr(body, name) for name in ("k1", "k3", "d1", "d3", "fixed", "masses")}
    return Trunk(Body(positions=positions, springs=springs, **given), trunk.settings)


def led(trunk, gait, seconds=0.6):
    """Nodes (T, N, 3) under a teacher, from how the robot is drawn."""
    robot, target = new_robot(trunk), muscle_target(trunk, gait, 16.0)
    steps = round(seconds / robot.timestep)
    told = target.sample(robot.timestep * np.arange(steps))
    return nodes_of(trunk, robot.rollout(offset=told, gate=0.0, record=("qpos",)).get("qpos"))


def test_a_mirrored_robot_does_the_mirrored_thing(trunk):
    """In a bound, where left and right legs do the same."""
    one, other = trunk, mirrored(trunk)
    swap = np.r_[np.arange(trunk.settings.nodes), trunk.settings.nodes + np.array(OTHER_SIDE)]
    first, second = led(one, "bound"), led(other, "bound")[:, swap] * MIRROR
    # left and right are told the same in a bound, to the target's own accuracy
    assert np.abs(first - second).max() < 1e-6
    assert np.abs(np.diff(first[:, :, 1], axis=0)).max() > 1e-5


def test_in_free_fall_muscles_move_neither_the_centre_nor_the_momentum(trunk, lively):
    robot = new_robot(trunk, ground=False)
    robot.set_readout(lively)
    run = robot.rollout(1000, record=("qpos", "qvel", "outputs"))
    masses, nodes = trunk.body.masses, nodes_of(trunk, run.get("qpos"))
    centre = masses @ nodes / trunk.mass
    step, count = robot.timestep, np.arange(1000)
    fall = -GRAVITY * step**2 * count * (count + 1) / 2  # semi-implicit, exactly
    assert np.abs(centre[:, :2] - centre[0, :2]).max() < 1e-11
    assert np.abs(centre[:, 2] - centre[0, 2] - fall).max() < 1e-11
    speeds = run.get("qvel").reshape(1000, -1, 3)
    apart, rate = nodes - centre[:, None], speeds - (masses @ speeds / trunk.mass)[:, None]
    turning = (masses[:, None] * np.cross(apart, rate)).sum(axis=1)
    # what a step of velocity times position leaves of pulls along springs that move meanwhile
    assert np.ptp(turning, axis=0).max() < 1e-10
    assert np.abs(run.get("outputs")).max() > 0.01
    assert np.abs(apart - apart[0]).max() > 0.005


def test_standing_the_feet_bear_the_weight_and_nothing_else_touches(trunk):
    robot = new_robot(trunk)
    stand(robot)
    walked = walk(robot, trunk, 3.0)
    assert walked.contact[0, -1].sum() == pytest.approx(trunk.mass * GRAVITY, rel=1e-4)
    touching = {
        robot.model.geom(i).name
        for i in range(robot.model.ngeom)
        if robot.model.geom_contype[i] or robot.model.geom_conaffinity[i]
    }
    assert touching == {"ground", *LEGS}


def test_on_a_slope_the_ground_holds_weight_and_pull(trunk):
    """The component along the ground is friction's."""
    robot = new_robot(trunk, slope=0.1)
    stand(robot)
    walked = walk(robot, trunk, 3.0)
    assert walked.contact[0, -1].sum() == pytest.approx(
        trunk.mass * GRAVITY * np.cos(0.1), rel=1e-3
    )
    assert abs(walked.trunk[0, -1, 0] - walked.trunk[0, 0, 0]) < 4e-3  # soft friction creeps


def test_three_muscles_of_these_lengths_meet_where_the_foot_is_wanted(trunk):
    rng = np.random.default_rng(0)
    swing, lift = rng.uniform(-1, 1, (3, 4)), rng.uniform(0, 1, (3, 4))
    lengths = trunk.body.rest_lengths[trunk.n_sensed :] + muscle_lengths(trunk, swing, lift)
    muscles = trunk.body.springs[trunk.n_sensed :]
    for row in range(3):
        for leg in range(len(LEGS)):
            own = slice(3 * leg, 3 * leg + 3)
            hips = trunk.body.positions[muscles[own, 0]]
            foot = trunk.body.positions[muscles[own, 1][0]]
            found = least_squares(
                lambda p, hips=hips, own=own, row=row: np.linalg.norm(p - hips, axis=1)
                - lengths[row, own],
                foot, xtol=1e-15, ftol=1e-15, gtol=1e-15,
            ).x  # fmt: skip
            moved = [SPATIAL.swing * swing[row, leg], 0.0, SPATIAL.lift * lift[row, leg]]
            assert found - foot == pytest.approx(moved, abs=1e-9)


def test_poses_are_those_of_a_rigid_motion(trunk):
    turn = Rotation.from_euler("zyx", [2.5, 0.3, -0.2])
    drawn = trunk.body.positions.copy()  # SciPy wants to be able to write
    moved = turn.apply(drawn) + np.array([1.0, 2.0, 3.0])
    pose = poses(trunk, (moved - drawn).ravel())
    w, x, y, z = pose[3:]
    assert (Rotation.from_quat([x, y, z, w]) * turn.inv()).magnitude() < 1e-7
    assert pose[:3] == pytest.approx(moved[: trunk.settings.nodes].mean(axis=0), abs=1e-12)
    flat = poses(trunk, (Rotation.from_euler("z", 2.5).apply(drawn) - drawn).ravel())
    assert headings(flat[None])[0] == pytest.approx(2.5)


def test_the_energy_balance_closes_and_the_better_the_smaller_the_step(trunk):
    target = muscle_target(trunk, "trot", 16.0)
    errors = []
    for step in (4e-4, 1e-4):
        robot = new_robot(trunk, timestep=step)
        count = round(0.5 / step)
        told = target.sample(step * np.arange(2 * count))
        robot.rollout(offset=told[:count], gate=0.0, record=())
        balance = energy_balance(robot, trunk, count, told[count:])
        errors.append(balance.error)
        assert min(balance.work, balance.muscles, balance.trunk, balance.ground) > 0.0
        assert balance.positive > balance.work
    assert errors[0] < 1e-3
    assert errors[1] < 0.6 * errors[0]


def test_feet_go_along_circles_about_the_centre_of_the_way(trunk):
    """Seen from the centre, a foot's way is at right angles to its place, and as long as that."""
    curvature, small = 0.4, 1e-6
    swing = np.tile([0.0, small], (4, 1)).T
    lengths = muscle_lengths(trunk, swing, 0 * swing, curvature)
    muscles = trunk.body.springs[trunk.n_sensed :]
    feet = trunk.body.positions[trunk.settings.nodes :]
    centre = feet.mean(axis=0) + np.array([0.0, 1 / curvature, 0.0])
    for leg in range(len(LEGS)):
        own = slice(3 * leg, 3 * leg + 3)
        along = feet[leg] - trunk.body.positions[muscles[own, 0]]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        way = np.linalg.solve(along, np.diff(lengths[:, own], axis=0)[0]) / small
        away = feet[leg] - centre
        circle = SPATIAL.swing * curvature * np.array([-away[1], away[0], 0.0])
        assert way == pytest.approx(circle, abs=1e-6)


def test_designs_begin_with_the_robot_as_it_is():
    config = Config()
    assert designed(config, "pace", np.zeros(len(VARIED))) == config
    other = designed(config, "pace", np.full(len(VARIED), np.log(1.1)))
    assert other.pace == pytest.approx(1.1 * config.pace)
    assert other.trunk.swing == pytest.approx(1.1 * SPATIAL.swing)
    assert other.trunk.d1 == pytest.approx(tuple(1.1 * np.array(SPATIAL.d1)))
    changed = np.flatnonzero(np.array(other.trunk.lags) != SPATIAL.lags)
    assert changed.tolist() == [2]
    assert other.trunk.k1 == SPATIAL.k1


def test_carried_back_to_the_start_a_robot_goes_on_as_it_would(trunk):
    """Nothing in the world but gravity and a level ground knows of places and directions."""
    robot, angle = new_robot(trunk), 2.0
    target = muscle_target(trunk, "trot", 16.0)
    told = target.sample(robot.timestep * np.arange(2000))
    robot.rollout(offset=told[:1000], gate=0.0, record=())
    qpos, qvel = heading_ahead(trunk, robot)
    turn = Rotation.from_euler("z", angle).as_matrix()
    drawn = trunk.body.positions
    robot.set_state(
        ((drawn + qpos.reshape(-1, 3)) @ turn.T - drawn).ravel(),
        (qvel.reshape(-1, 3) @ turn.T).ravel(),
    )
    back, rate = heading_ahead(trunk, robot)
    assert np.abs(back - qpos).max() < 1e-12
    assert np.abs(rate - qvel).max() < 1e-12
    ends = []
    for start in ((qpos, qvel), (robot.qpos, robot.qvel)):
        robot.set_state(*start)
        robot.rollout(offset=told[1000:1100], gate=0.0, record=())
        ends.append(heading_ahead(trunk, robot)[0])
    assert np.abs(ends[0] - ends[1]).max() < 1e-9
