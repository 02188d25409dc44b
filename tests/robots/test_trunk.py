"""A trunk that is the computer: momentum, weight, and a loop closed by nothing but springs."""

import mujoco
import numpy as np
import pytest

from mcmj.core.callbacks import install
from mcmj.experiments.trunk.result import forward_speed
from mcmj.metrics.orbits import orbit_error
from mcmj.robots.force_learning import ForceLearning, force_learn
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import N_MUSCLES, TrunkSettings, draw_trunk, muscle_lengths, muscle_target
from mcmj.robots.trunk_walker import TrunkWalker
from mcmj.robots.walk_metrics import fall_times, speeds
from mcmj.targets.gaits import LEGS, POINTS, gait_target
from mcmj.utils.errors import InvalidArgumentError


@pytest.fixture(scope="module")
def trunk():
    return draw_trunk(3)


@pytest.fixture(scope="module")
def lively(trunk):
    """A readout that keeps the muscles moving: in free fall nothing else does."""
    return 0.3 * np.random.default_rng(1).normal(size=(trunk.n_sensed + 1, N_MUSCLES))


def nodes_of(trunk, walk):
    """Positions (T, N, 2) of all nodes."""
    return trunk.body.positions + walk.joints[0].reshape(len(walk.times), -1, 2)


def in_flight(trunk, readout, timestep):
    walker = TrunkWalker(trunk, timestep=timestep, ground=False)
    walker.set_readout(readout)
    walker.close(True)
    return walker.walk(0.4, sample=4e-3, joints=True)


def angular_momenta(trunk, readout, timestep):
    """About the centre of mass (40,), every 10 ms of a free fall, from MuJoCo's state."""
    walker = TrunkWalker(trunk, timestep=timestep, ground=False)
    walker.set_readout(readout)
    walker.close(True)
    data, masses = mujoco.MjData(walker.model), trunk.body.masses[:, None]
    found = []
    for _ in range(40):
        walker.advance(round(0.01 / timestep))
        mujoco.mj_setState(walker.model, data, walker.state, mujoco.mjtState.mjSTATE_INTEGRATION)
        place = trunk.body.positions + data.qpos.reshape(-1, 2)
        speed = data.qvel.reshape(-1, 2)
        apart, rate = (v - (masses * v).sum(axis=0) / trunk.mass for v in (place, speed))
        turning = apart[:, 0] * rate[:, 1] - apart[:, 1] * rate[:, 0]
        found.append(trunk.body.masses @ turning)
    return np.array(found)


def test_in_free_fall_muscles_move_the_body_but_not_its_centre(trunk, lively):
    walk = in_flight(trunk, lively, 1e-3)
    nodes, step = nodes_of(trunk, walk), 1e-3
    centre = (trunk.body.masses[:, None] * nodes).sum(axis=1) / trunk.mass
    fall = -GRAVITY * walk.times * (walk.times + step) / 2  # semi-implicit, exactly
    # the discrete integrator's equations are solved to some 1e-8
    assert np.abs(centre[:, 0] - centre[0, 0]).max() < 4e-8
    assert np.abs(centre[:, 1] - centre[0, 1] - (fall - fall[0])).max() < 4e-8
    assert np.abs(walk.outputs).max() > 0.01
    assert np.abs(nodes - centre[:, None] - (nodes[0] - centre[0])).max() > 0.01


def test_in_free_fall_angular_momentum_is_kept(trunk, lively):
    """No joint and no actuator turns against the world."""
    assert np.ptp(angular_momenta(trunk, lively, 1e-3)) < 6e-7  # kg m^2/s; solved to some 1e-8


@pytest.mark.parametrize("sample", [0.01, 0.03, 0.25])
def test_a_push_gives_its_impulse_and_is_over(trunk, sample):
    walker = TrunkWalker(trunk, ground=False)
    walker.walk(0.5, push=10.0, sample=sample)
    data = mujoco.MjData(walker.model)
    mujoco.mj_setState(walker.model, data, walker.state, mujoco.mjtState.mjSTATE_INTEGRATION)
    momentum = trunk.body.masses @ data.qvel[::2]
    assert momentum == pytest.approx(10.0, rel=1e-5)
    assert not data.qfrc_applied.any()


def test_standing_the_feet_bear_the_weight(trunk):
    walker = TrunkWalker(trunk)
    walker.stand()
    walk = walker.walk(8.0)
    load = walk.contact[0, -1]
    assert load.sum() == pytest.approx(trunk.mass * GRAVITY, rel=1e-6)
    assert (load > 0).all()
    assert speeds(walk)[0] < 1e-3


def test_muscles_of_these_lengths_meet_where_the_foot_is_wanted(trunk):
    """By the law of cosines, from the two upper ends."""
    rng = np.random.default_rng(0)
    swing, lift = rng.uniform(-1, 1, (5, 4)), rng.uniform(0, 1, (5, 4))
    lengths = trunk.body.rest_lengths[-N_MUSCLES:] + muscle_lengths(trunk, swing, lift)
    muscles = trunk.body.springs[-N_MUSCLES:]
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
    walker = TrunkWalker(trunk)
    walker.stand()
    walker.set_readout(0.1 * lively)
    walker.close(True)
    walk = walker.walk(0.5, joints=True)
    nodes, n = nodes_of(trunk, walk), trunk.n_sensed
    ends = nodes[:, trunk.body.springs[:n]]
    strain = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1) - trunk.body.rest_lengths[:n]
    commands = np.column_stack([strain, np.ones(len(strain))]) @ (0.1 * lively)
    assert np.abs(walk.outputs[0] - commands).max() < 1e-13
    assert np.ptp(commands, axis=0).max() > 1e-4
    walker.advance(1)
    force = walker.model.actuator("m0"), walker._batch.bind("actuator_force")[0]
    assert force[1] == pytest.approx(trunk.settings.muscle_stiffness * commands[-1], rel=1e-12)


def test_a_state_is_restored_bit_for_bit_and_a_seed_gives_the_same_robot(trunk, lively):
    ends = []
    for _ in range(2):
        walker = TrunkWalker(draw_trunk(3))
        walker.stand()
        walker.set_readout(0.1 * lively)
        walker.close(True)
        state = walker.state
        heard = walker.features()
        first = walker.walk(0.2, joints=True)
        assert not np.array_equal(walker.features(), heard)
        walker.restore(state)
        assert np.array_equal(walker.features(), heard)
        again = walker.walk(0.2, joints=True)
        assert np.array_equal(first.joints, again.joints)
        ends.append(first.joints)
    assert np.array_equal(*ends)
    assert not np.array_equal(draw_trunk(4).body.positions, trunk.body.positions)


def test_a_target_of_muscles_is_a_gait_at_its_pace(trunk):
    target = muscle_target(trunk, "trot", 11.0)
    assert target.period == pytest.approx(gait_target("trot").period / 11.0, rel=1e-12)
    swing = gait_target("trot").orbit(POINTS)[::100]
    wanted = target.orbit(POINTS)[::100]
    assert wanted.shape == (len(swing), N_MUSCLES)
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
        TrunkWalker(trunk, integrator="leapfrog")


@pytest.mark.slow
def test_it_learns_to_trot_starts_from_rest_and_does_not_depend_on_the_step():
    trunk = draw_trunk(1)
    target, walker = muscle_target(trunk, "trot", 11.0), TrunkWalker(trunk)
    learned = force_learn(walker, target, ForceLearning(rounds=1), seed=1)
    errors, paces = [], []
    for timestep in (1e-3, 5e-4):
        other = TrunkWalker(trunk, timestep=timestep)
        other.set_readout(learned.w_out)
        other.stand()
        other.close(True)
        walk = other.walk(20.0)
        assert np.isinf(fall_times(walk, trunk.settings.leg)).all()
        errors.append(orbit_error(walk.after(14.0).outputs[0], target))
        paces.append(forward_speed(walk.after(14.0)))
    assert max(errors) < 0.1
    assert min(paces) > 0.6
    assert paces[1] == pytest.approx(paces[0], rel=0.03)


def test_a_walker_installs_callbacks_that_were_taken_out(trunk, lively):
    def outputs(spoil):
        walker = TrunkWalker(trunk, ground=False)
        walker.set_readout(lively)
        walker.close(True)
        spoil()
        walker.advance(100)
        spoil()
        return walker.walk(0.1).outputs

    assert outputs(install.uninstall).tobytes() == outputs(lambda: None).tobytes()
