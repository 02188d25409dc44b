"""A robot driven by a body: no gait without the body's springs, the same bits, exact oracles."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mcmj.core.callbacks import install
from mcmj.experiments.walk.config import Config
from mcmj.experiments.walk.recover import distances_from, recovery
from mcmj.mjcf.bundled import body_path
from mcmj.mjcf.read import body_of_model, load_model, readouts_of_model
from mcmj.pictures.walk_video import BAR, MARK, Event, GaitDiagram
from mcmj.robots.ground_training import teach_on_ground
from mcmj.robots.leg_readouts import LegReadout, lift_of, teach_lift
from mcmj.robots.quadruped import Quadruped, Stride
from mcmj.robots.walk_metrics import (
    Walk,
    costs_of_transport,
    distances,
    fall_times,
    phase_shift,
    stride_period,
    turns,
)
from mcmj.robots.walk_scene import Terrain
from mcmj.robots.walker import Walker
from mcmj.simulation.simulation import Simulation
from mcmj.targets.gaits import LEGS, gait_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

ROBOT = Quadruped()


@pytest.fixture(scope="module")
def body():
    return body_of_model(load_model(body_path("gaits")))


@pytest.fixture(scope="module")
def trot(body):
    w_out = readouts_of_model(load_model(body_path("gaits")))["trot"]
    gait, fit = teach_lift(body, w_out, gait_target("trot"), duration=10.0, engine="twin")
    assert fit.train_nrmse < 0.05
    return gait


def started(body, gait, **options):
    walker = Walker(body, ROBOT, **options)
    walker.start(gait)
    return walker


def test_the_robot_walks_and_the_body_does_not_know(body, trot):
    """Without coupling the outputs are those of the body alone, pace times faster."""
    walker = started(body, trot)
    walk = walker.walk(2.5)
    assert np.isinf(fall_times(walk, ROBOT.leg)).all()
    assert walk.trunk[0, -1, 0] - walk.trunk[0, 0, 0] > 2.0
    alone = Simulation(body, w_out=trot.swing)
    alone.set_state(trot.start.positions, trot.start.velocities)
    steps = round(walk.sample / walker.timestep)
    outputs = alone.rollout(len(walk.times) * steps + 1, record=("outputs",)).outputs
    assert np.abs(walk.outputs[0] - outputs[steps::steps]).max() < 1e-11


def test_a_robot_installs_callbacks_that_were_taken_out(body, trot):
    def joints(spoil):
        walker = started(body, trot)
        spoil()
        walker.advance(1000)
        spoil()
        return walker.walk(0.2, joints=True).joints

    assert joints(install.uninstall).tobytes() == joints(lambda: None).tobytes()


@pytest.mark.parametrize("damage", ["cut_springs", "freeze"])
def test_without_the_bodys_springs_the_legs_stop(body, trot, damage):
    """No trajectory is replayed."""
    walker = started(body, trot)
    walker.walk(1.0)
    getattr(walker, damage)()
    walker.walk(2.5)
    walk = walker.walk(0.5, joints=True)
    hips = walk.joints[0][:, -2 * len(LEGS) :: 2]
    assert np.ptp(walk.outputs[0], axis=0).max() < 1e-9
    assert np.ptp(hips, axis=0).max() < 5e-3  # 0.4 rad when it walks
    assert distances(walk)[0] < 0.03  # 0.8 m when it walks


def test_the_ground_changes_the_rhythm_only_if_coupled(body, trot):
    runs = {
        (coupling, load): started(body, trot, coupling=coupling, terrain=Terrain(load=load))
        .walk(1.0)
        .outputs
        for coupling in (0.0, -0.4)
        for load in (0.0, 50.0)
    }
    assert np.array_equal(runs[0.0, 0.0], runs[0.0, 50.0])
    assert np.abs(runs[-0.4, 0.0] - runs[-0.4, 50.0]).max() > 0.01


def test_what_enters_the_body_is_the_load_on_the_servos(body, trot):
    """u_i = g F_i / (M gravity), F_i minus the force of the leg's two actuators."""
    walker = started(body, trot, coupling=0.4, terrain=Terrain(load=20.0))
    forces = walker._batch.bind("actuator_force")
    walker.advance(8000)
    force = {walker.model.actuator(i).name: f for i, f in enumerate(forces[0])}
    heard = [force[f"in{i}"] for i in range(len(LEGS))]
    borne = [-force[f"robot/{leg}_lift"] - force[f"robot/{leg}_leg_servo"] for leg in LEGS]
    assert np.abs(borne).max() > 100.0
    assert heard == pytest.approx(0.4 * np.array(borne) / (9.81 * ROBOT.mass), rel=1e-9, abs=1e-12)


def test_a_teacher_leads_body_and_legs(body, trot):
    """The body as under teacher forcing without a robot; the legs where the teacher says."""
    walker = started(body, trot)
    target, steps = gait_target("trot"), 2000
    positions = target.sample(1e-3 * np.arange(steps))
    noise = 0.2 * np.random.default_rng(0).standard_normal((steps, len(LEGS)))
    told = np.hstack([positions, lift_of(positions)])
    lengths = walker.led(told[None], noise[None])[0]
    alone = Simulation(body, w_out=trot.swing)
    alone.set_state(trot.start.positions, trot.start.velocities)
    wanted = alone.rollout(steps, offset=positions + noise, gate=np.zeros(len(LEGS)))
    assert np.abs(lengths - wanted.get("lengths")).max() < 1e-11
    state = walker.body_state()
    assert np.abs(state.positions - alone.state.positions).max() < 1e-11
    assert np.abs(state.velocities - alone.state.velocities).max() < 1e-11
    still = np.tile([0.5, 0.5, -0.5, -0.5, 0.0, 0.0, 0.0, 0.0], (1, 8000, 1))
    walker.led(still, 0 * still[..., :4])
    hips = walker.walk(1e-3, sample=1e-3, joints=True).joints[0, -1, -2 * len(LEGS) :: 2]
    stride = trot.stride
    wanted = stride.of_legs("swing") * still[0, 0, :4] + stride.of_legs("lean")
    assert hips == pytest.approx(wanted, abs=0.02)  # the load bends the servos


def test_a_body_taught_on_the_ground_keeps_the_targets_pace(body, trot):
    """Coupled, with the readouts of a body that never bore loads, the stride is off by 3 %."""
    walker = started(body, trot, coupling=0.4)
    grounded, fit = teach_on_ground(walker, trot, gait_target("trot"), 0, duration=30.0)
    assert fit.train_nrmse < 0.02
    wanted = gait_target("trot").period / walker.pace
    periods = []
    for gait in (trot, grounded):
        walker.start(gait)
        walk = walker.walk(3.0)
        assert np.isinf(fall_times(walk, ROBOT.leg)).all()
        periods.append(stride_period(walk.after(1.5), wanted))
    assert abs(periods[0] / wanted - 1) > 0.01
    assert periods[1] == pytest.approx(wanted, rel=0.003)


def test_robots_put_back_on_their_feet(body, trot):
    walker = started(body, trot)
    first = walker.snapshot()
    walker.walk(0.5)
    before = walker.body_state()
    walker.stand()
    assert np.array_equal(walker.body_state().positions, before.positions)
    assert np.array_equal(walker.body_state().velocities, before.velocities)
    robot = np.arange(walker._nodes, walker.model.nq) + 1  # the state begins with the time
    assert np.array_equal(walker.snapshot()[0, robot], first[0, robot])


def test_copies_and_repeats_give_the_same_bits(body, trot):
    one = started(body, trot, coupling=-0.4).walk(0.6)
    two = started(body, trot, coupling=-0.4, copies=2).walk(0.6)
    for copy in (0, 1):
        assert np.array_equal(two.trunk[copy], one.trunk[0])
        assert np.array_equal(two.outputs[copy], one.outputs[0])


def test_a_push_changes_the_momentum_by_its_impulse(body, trot):
    """In free fall: m dv = impulse, whatever the legs do."""
    walker = started(body, trot, copies=2)
    walker._batch.bind("qpos")[:, walker._nodes + 2] += 50.0
    impulse = 30.0
    walker.walk(0.2, push=[[0.0, 0.0], [0.0, impulse]])
    momenta = []
    for copy in (0, 1):
        data = walker._batch.get_data(copy)
        mujoco.mj_forward(walker.model, data)
        mujoco.mj_subtreeVel(walker.model, data)
        momenta.append(walker.mass * data.subtree_linvel[walker.model.body("robot/trunk").id])
    assert np.abs(momenta[1] - momenta[0] - [0.0, impulse, 0.0]).max() < 1e-5 * impulse


def test_a_standing_robot_bears_its_weight(body, trot):
    still = LegReadout(0 * trot.swing, 0 * trot.lift, trot.start, Stride(lean=(0.0, 0.0)))
    walker = started(body, still)
    walker.walk(3.0)
    assert walker.walk(0.1).contact[0, -1].sum() == pytest.approx(9.81 * walker.mass, rel=1e-3)


def made_up(trunk, **arrays):
    """A walk of one copy with these poses (T, 7), sampled every 10 ms."""
    n = len(trunk)
    given = {"outputs": np.zeros((1, n, 4)), "contact": np.zeros((1, n, 4)),
             "power": np.zeros((1, n))} | arrays  # fmt: skip
    return Walk(0.01 * np.arange(1, n + 1), trunk[None], **given)


def poses(n, **columns):
    trunk = np.tile([0, 0, 1, 1, 0, 0, 0], (n, 1)).astype(float)
    for name, values in columns.items():
        trunk[:, "xyz".index(name) if name in "xyz" else 3 + "wijk".index(name)] = values
    return trunk


def test_falls_distances_and_turns_of_made_up_walks():
    angle = np.linspace(0.0, np.pi / 2, 101)  # rolls over about x
    roll = made_up(poses(101, w=np.cos(angle / 2), i=np.sin(angle / 2)))
    over = np.flatnonzero(angle > np.pi / 3)[0]
    assert fall_times(roll, 1.0)[0] == pytest.approx(roll.times[over])
    sink = made_up(poses(100, z=np.linspace(1.0, 0.0, 100)))
    assert fall_times(sink, 1.0)[0] == pytest.approx(0.51)
    assert np.isinf(fall_times(made_up(poses(10)), 1.0)[0])
    turn = made_up(poses(101, w=np.cos(angle / 2), k=np.sin(angle / 2)))
    assert turns(turn)[0] == pytest.approx(np.pi / 2)
    line = made_up(poses(101, x=np.linspace(0, 3, 101), y=np.linspace(0, 4, 101)),
                   power=np.full((1, 101), 20.0))  # fmt: skip
    assert distances(line)[0] == pytest.approx(5.0)
    assert costs_of_transport(line, weight=10.0)[0] == pytest.approx(20.0 / 50.0)


def test_phase_shift_and_recovery_of_made_up_rhythms():
    times = 0.01 * np.arange(1, 801)
    ahead = np.stack([np.sin(2 * np.pi * (times + lead)) for lead in (0.0, 0.1)])
    walk = Walk(times, np.zeros((2, 800, 7)), np.repeat(ahead[..., None], 4, axis=2),
                np.zeros((2, 800, 4)), np.zeros((2, 800)))  # fmt: skip
    assert phase_shift(walk, 1.0, 1) == pytest.approx(0.1, abs=1e-6)
    circle = np.column_stack([np.cos(2 * np.pi * times), np.sin(2 * np.pi * times)])
    kicked = circle * (1 + 0.5 * np.exp(-times))[:, None]
    away = distances_from(circle, kicked)
    assert away[0] == pytest.approx(0.5, abs=0.01)
    assert recovery(away, 0.01) == pytest.approx(np.log(0.5 / 0.03), abs=0.02)


def test_the_diagram_of_a_film_closes_bounces_and_marks_switches():
    contact = np.zeros((1, 300, 4))
    contact[0, :, 0] = 1.0
    contact[0, 100:102, 0] = 0.0  # a bounce
    contact[0, 150:, 1] = 1.0
    walk = made_up(poses(300), contact=contact)
    picture = GaitDiagram(walk, [Event(0.0, "walk"), Event(2.0, "trot")]).draw(3.0).astype(int)
    blue = (np.abs(picture - BAR).sum(axis=-1) < 10).sum(axis=1)  # pixels in a line
    lines = blue[blue > 0].reshape(2, -1)  # two legs that stand, each bar as high
    assert np.ptp(lines, axis=1).max() == 0
    assert lines[0, 0] == pytest.approx(2 * lines[1, 0], rel=0.02)
    marked = (np.abs(picture - MARK).sum(axis=-1) < 10).sum(axis=0)
    assert marked.argmax() == pytest.approx(40 + (320 - 48) * 2 / 3, abs=2)


def test_a_leg_is_lifted_when_its_output_rises():
    outputs = np.sin(np.linspace(0, 4 * np.pi, 401))[:, None]
    lifts = lift_of(outputs)
    assert lifts[[0, 200, 400]] == pytest.approx(1.0, abs=1e-3)
    assert not lifts[60:140].any()


def test_errors_name_the_argument(body):
    with pytest.raises(UnknownNameError, match="unknown gait 'gallop'"):
        Config(gaits=("gallop",))
    with pytest.raises(UnknownNameError, match="unknown part 'swim'"):
        Config(parts=("swim",))
    with pytest.raises(InvalidArgumentError, match="coupling: expected a number other than 0"):
        Config(coupling=0.0)
    with pytest.raises(InvalidArgumentError, match="after: expected"):
        Config(parts=("adapt",), after=1.0)
    with pytest.raises(InvalidArgumentError, match="leg: expected"):
        Quadruped(leg=-1.0)
    with pytest.raises(InvalidArgumentError, match="body: expected 4 inputs and outputs"):
        Walker(replace(body, w_fb=body.w_fb[:, :2]), ROBOT)
