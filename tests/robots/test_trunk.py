"""A trunk that is the computer: momentum, weight, and a loop closed by nothing but springs."""

import numpy as np
import pytest

from mcmj.experiments.trunk.result import forward_speed
from mcmj.learning.force_learning import ForceLearning, force_learn
from mcmj.learning.free_run import trial_error
from mcmj.metrics.orbits import orbit_error
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import TrunkSettings, draw_trunk, muscle_lengths, muscle_target
from mcmj.robots.trunk_walker import has_fallen, new_robot, stand, walk
from mcmj.robots.walk_metrics import fall_times, speeds
from mcmj.targets.gaits import LEGS, POINTS, gait_target
from mcmj.utils.errors import InvalidArgumentError


@pytest.fixture(scope="module")
def trunk():
    return draw_trunk(3)


@pytest.fixture(scope="module")
def lively(trunk):
    """A readout that keeps the muscles moving: in free fall nothing else does."""
    return 0.3 * np.random.default_rng(1).normal(size=(trunk.n_sensed + 1, trunk.n_muscles))


def nodes_of(trunk, walked):
    """Positions (T, N, 2) of all nodes."""
    return trunk.body.positions + walked.joints[0].reshape(len(walked.times), -1, 2)


def flying(trunk, readout, timestep=1e-3):
    robot = new_robot(trunk, timestep=timestep, ground=False)
    robot.set_readout(readout)
    return robot


def angular_momenta(trunk, robot):
    """About the centre of mass (40,), every 10 ms of a free fall."""
    masses, found = trunk.body.masses[:, None], []
    for _ in range(40):
        robot.rollout(round(0.01 / robot.timestep), record=())
        place = trunk.body.positions + robot.qpos.reshape(-1, 2)
        speed = robot.qvel.reshape(-1, 2)
        apart, rate = (v - (masses * v).sum(axis=0) / trunk.mass for v in (place, speed))
        turning = apart[:, 0] * rate[:, 1] - apart[:, 1] * rate[:, 0]
        found.append(trunk.body.masses @ turning)
    return np.array(found)


def test_in_free_fall_muscles_move_the_body_but_not_its_centre(trunk, lively):
    walked = walk(flying(trunk, lively), trunk, 0.4, sample=4e-3)
    nodes, step = nodes_of(trunk, walked), 1e-3
    centre = (trunk.body.masses[:, None] * nodes).sum(axis=1) / trunk.mass
    fall = -GRAVITY * walked.times * (walked.times + step) / 2  # semi-implicit, exactly
    # the discrete integrator's equations are solved to some 1e-8
    assert np.abs(centre[:, 0] - centre[0, 0]).max() < 4e-8
    assert np.abs(centre[:, 1] - centre[0, 1] - (fall - fall[0])).max() < 4e-8
    assert np.abs(walked.outputs).max() > 0.01
    assert np.abs(nodes - centre[:, None] - (nodes[0] - centre[0])).max() > 0.01


def test_in_free_fall_angular_momentum_is_kept(trunk, lively):
    """No joint and no actuator turns against the world."""
    assert (
        np.ptp(angular_momenta(trunk, flying(trunk, lively))) < 6e-7
    )  # kg m^2/s; solved to some 1e-8


@pytest.mark.parametrize("timestep", [1e-3, 7e-4])
def test_a_push_gives_its_impulse_and_is_over(trunk, timestep):
    robot = new_robot(trunk, timestep=timestep, ground=False)
    for impulse in (10.0, 0.0):
        walk(robot, trunk, 0.5, push=impulse)
        assert trunk.body.masses @ robot.qvel[::2] == pytest.approx(10.0, rel=1e-5)


def test_standing_the_feet_bear_the_weight(trunk):
    robot = new_robot(trunk)
    stand(robot)
    walked = walk(robot, trunk, 8.0)
    load = walked.contact[0, -1]
    assert load.sum() == pytest.approx(trunk.mass * GRAVITY, rel=1e-6)
    assert (load > 0).all()
    assert speeds(walked)[0] < 1e-3
    assert not has_fallen(trunk)(robot.rollout(10, record=("qpos",)))


def test_a_robot_without_ground_has_fallen(trunk):
    robot = new_robot(trunk, ground=False)
    assert has_fallen(trunk)(robot.rollout(1000, record=("qpos",)))


def test_muscles_of_these_lengths_meet_where_the_foot_is_wanted(trunk):
    """By the law of cosines, from the two upper ends."""
    rng = np.random.default_rng(0)
    swing, lift = rng.uniform(-1, 1, (5, 4)), rng.uniform(0, 1, (5, 4))
    lengths = trunk.body.rest_lengths[trunk.n_sensed :] + muscle_lengths(trunk, swing, lift)
    muscles = trunk.body.springs[trunk.n_sensed :]
    for leg in range(len(LEGS)):
        (fore, foot), (rear, _) = muscles[2 * leg : 2 * leg + 2]
        a, b = trunk.body.positions[fore], trunk.body.positions[rear]
        long, short = lengths[:, 2 * leg], lengths[:, 2 * leg + 1]
        apart = np.linalg.norm(b - a)
        along = (long**2 - short**2 + apart**2) / (2 * apart)
        height = -np.sqrt(long**2 - along**2)
        place = trunk.body.positions[foot]
        x = a[0] - along - place[0]  # both ends are at one height, the rear one behind
        assert a[1] == b[1]
        assert x == pytest.approx(trunk.settings.swing * swing[:, leg], abs=1e-12)
        assert a[1] + height - place[1] == pytest.approx(
            trunk.settings.lift * lift[:, leg], abs=1e-12
        )


def test_the_muscles_hear_of_nothing_but_the_trunks_springs(trunk, lively):
    """Commands from positions in NumPy, and their forces, against MuJoCo's."""
    robot, n = new_robot(trunk), trunk.n_sensed
    stand(robot)
    readout = 0.1 * lively
    readout[n] -= trunk.body.rest_lengths[:n] @ readout[:n]
    robot.set_readout(readout)
    walked = walk(robot, trunk, 0.5, sample=1e-3)
    ends = nodes_of(trunk, walked)[:, trunk.body.springs]
    lengths = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
    commands = np.column_stack([lengths[:, :n], np.ones(len(lengths))]) @ readout
    assert np.abs(walked.outputs[0] - commands).max() < 1e-13
    assert np.ptp(commands, axis=0).max() > 1e-4
    force = trunk.settings.muscle_stiffness * commands
    rate = np.diff(lengths[:, n:], axis=0) / 1e-3  # speeds move the nodes in the step before
    power = np.maximum(force[1:] * rate, 0.0).sum(axis=1)
    assert np.abs(force).max() < trunk.settings.muscle_strength
    assert np.abs(walked.power[0, 1:] - power).max() < 1e-3 * power.max()


def test_a_seed_gives_the_same_robot_and_walk(trunk, lively):
    ends = []
    for _ in range(2):
        robot = new_robot(draw_trunk(3))
        stand(robot)
        robot.set_readout(0.1 * lively)
        ends.append(walk(robot, trunk, 0.2).joints)
    assert np.array_equal(*ends)
    assert not np.array_equal(draw_trunk(4).body.positions, trunk.body.positions)


def test_a_target_of_muscles_is_a_gait_at_its_pace(trunk):
    target = muscle_target(trunk, "trot", 11.0)
    assert target.period == pytest.approx(gait_target("trot").period / 11.0, rel=1e-12)
    swing = gait_target("trot").orbit(POINTS)[::100]
    wanted = target.orbit(POINTS)[::100]
    assert wanted.shape == (len(swing), trunk.n_muscles)
    down = np.gradient(gait_target("trot").orbit(POINTS), axis=0)[::100] < -1e-5
    still = muscle_lengths(trunk, swing, np.zeros_like(swing))
    assert np.abs((wanted - still)[np.repeat(down, 2, axis=1)]).max() < 1e-9
    shorter = (still - wanted).max(axis=0)  # in the middle of the swing
    assert shorter == pytest.approx(trunk.settings.lift, rel=0.1)


@pytest.mark.parametrize(
    "change", [{"nodes": 6}, {"hip": 0.4}, {"mass": 0.0}, {"k1": (2.0, 1.0)}, {"foot": np.nan}]
)
def test_settings_name_what_is_wrong(change):
    with pytest.raises(InvalidArgumentError, match=next(iter(change))):
        TrunkSettings(**change)


def test_leapfrog_is_refused(trunk):
    with pytest.raises(InvalidArgumentError, match="integrator: expected one of MuJoCo's"):
        new_robot(trunk, integrator="leapfrog")


@pytest.mark.slow
def test_it_learns_to_trot_starts_from_rest_and_does_not_depend_on_the_step():
    trunk = draw_trunk(1)
    target, robot = muscle_target(trunk, "trot", 11.0), new_robot(trunk)
    learned = force_learn(
        robot, target, ForceLearning(rounds=1), seed=1,
        stand=lambda: stand(robot),
        judge=lambda: trial_error(robot, target, 20.0, has_fallen(trunk)),
    )  # fmt: skip
    errors, paces = [], []
    for timestep in (1e-3, 5e-4):
        other = new_robot(trunk, timestep=timestep)
        other.set_readout(learned.w_out)
        stand(other)
        walked = walk(other, trunk, 20.0)
        assert np.isinf(fall_times(walked, trunk.settings.leg)).all()
        errors.append(orbit_error(walked.after(14.0).outputs[0], target))
        paces.append(forward_speed(walked.after(14.0)))
    assert max(errors) < 0.1
    assert min(paces) > 0.6
    assert paces[1] == pytest.approx(paces[0], rel=0.03)
