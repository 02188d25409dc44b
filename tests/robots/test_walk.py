"""A robot driven by a body: no gait without the body's springs, the same bits, exact oracles."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mcmj.experiments.walk.config import Config
from mcmj.experiments.walk.recover import distances_from, recovery
from mcmj.mjcf.bundled import body_path
from mcmj.mjcf.read import body_of_model, load_model, readouts_of_model
from mcmj.pictures.walk_video import BAR, MARK, Event, GaitDiagram
from mcmj.robots.ground_training import teach_on_ground
from mcmj.robots.leg_readouts import LegReadout, lift_of, teach_lift
from mcmj.robots.quadruped import Quadruped
from mcmj.robots.rescale import SIZE, rescaled
from mcmj.robots.walk_metrics import (
    Walk,
    costs_of_transport,
    distances,
    fall_times,
    phase_shift,
    stride_period,
    turns,
)
from mcmj.robots.walk_scene import Terrain, walking_model
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
    gait = teach_lift(body, w_out, gait_target("trot"), duration=10.0, engine="twin")
    assert gait.nrmse < 0.05
    return gait


def started(body, gait, **options):
    walker = Walker(body, ROBOT, **options)
    walker.start(gait)
    return walker


def alone_in(body, gait):
    """The body without a robot, in the units it was taught in, where a walker starts."""
    w_out = gait.w_out[:, : len(LEGS)].copy()
    w_out[:-1] *= SIZE
    alone = Simulation(body, w_out=w_out, integrator="Euler")
    state = np.zeros((2, body.n_nodes, 2))
    state[:, body.free] = gait.start.reshape(2, -1, 2)
    alone.set_state(body.positions + state[0] / SIZE, state[1] / (8 * SIZE))
    return alone


def test_the_robot_walks_and_the_body_does_not_know(body, trot):
    """Without coupling the outputs are those of the body alone, pace times faster."""
    walker = started(body, trot)
    walk = walker.walk(2.5)
    assert np.isinf(fall_times(walk, ROBOT.leg)).all()
    assert walk.trunk[0, -1, 0] - walk.trunk[0, 0, 0] > 2.0
    steps = round(walk.sample / walker.timestep)
    alone = alone_in(body, trot).rollout(len(walk.times) * steps, record=("outputs",))
    assert np.abs(walk.outputs[0] - alone.outputs[::steps]).max() < 7e-13


def test_a_walk_agrees_with_a_plain_loop(body, trot):
    """The law by hand, in the scene without its actuators' own; both with the load in the body."""
    coupling, load, steps = 0.4, 20.0, 4000
    walker = started(body, trot, coupling=coupling, terrain=Terrain(load=load))
    walk = walker.walk(steps * walker.timestep, sample=walker.timestep, joints=True)
    spec = walking_model(rescaled(body, pace=8.0, size=SIZE), ROBOT, Terrain(load=load), 0.0)
    spec.option.timestep = walker.timestep
    model = spec.compile()
    data = mujoco.MjData(model)
    n = trot.start.shape[1]
    data.qpos[:n], data.qvel[:n] = trot.start
    places = model.jnt_qposadr, model.jnt_dofadr
    at, dof = ([p[model.joint(f"robot/{leg}_leg").id] for leg in LEGS] for p in places)
    ids = [
        [model.actuator(name.format(i=i, leg=leg)).id for i, leg in enumerate(LEGS)]
        for name in ("fb{i}", "robot/{leg}_hip", "robot/{leg}_leg", "in{i}")
    ]
    outputs, joints, power, contact = [], [], [], []
    for _ in range(steps):
        mujoco.mj_fwdPosition(model, data)
        told = data.ten_length[: body.n_springs] @ trot.w_out[:-1] + trot.w_out[-1]
        qpos, qvel = data.qpos.copy(), data.qvel.copy()
        borne = ROBOT.leg_stiffness * (qpos[at] - told[8:]) + ROBOT.leg_damping * qvel[dof]
        data.ctrl[np.ravel(ids)] = np.r_[told, coupling * borne / (9.81 * ROBOT.mass)]
        mujoco.mj_step(model, data)
        outputs.append(told[:4])
        joints.append(qpos)
        power.append(np.maximum(data.qfrc_actuator * qvel, 0.0)[n + 6 :].sum())
        contact.append([data.sensor(f"robot/{leg}_contact").data[0] for leg in LEGS])
    assert np.max(np.abs(borne)) > 100.0
    assert np.abs(walk.outputs[0] - outputs).max() < 1e-12
    assert np.abs(walk.joints[0] - joints).max() < 2e-14
    assert np.abs(walk.power[0] - power).max() < 1e-12 * np.max(power)
    assert np.abs(walk.contact[0] - contact).max() < 1e-12 * np.max(contact)


@pytest.mark.parametrize("damage", ["cut", "frozen"])
def test_without_the_bodys_springs_the_legs_stop(body, trot, damage):
    """No trajectory is replayed."""
    walker = started(body, trot)
    walker.walk(1.0)
    if damage == "cut":  # broken springs measure nothing
        walker.alter(cut=[f"s{j}" for j in range(body.n_springs)])
        nothing, bias = np.zeros((len(trot.w_out), 4)), np.eye(len(trot.w_out))[:, -1:]
        walker.set_readout(trot.stride.commands(nothing, nothing, bias))
    else:
        walker.alter(masses={f"n{i}": 1e15 for i in body.free})
        qvel = walker.qvel
        qvel[: walker.motion.shape[-1]] = 0.0
        walker.set_state(qvel=qvel)
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


def test_a_teacher_leads_body_and_legs(body, trot):
    """The body as under teacher forcing without a robot; the legs where the teacher says."""
    walker = started(body, trot)
    target, steps = gait_target("trot"), 2000
    positions = target.sample(1e-3 * np.arange(steps))
    told = trot.stride.commands(positions, lift_of(positions))
    run = walker.rollout(offset=told, gate=0.0)
    alone = alone_in(body, trot)
    wanted = alone.rollout(steps, offset=positions, gate=0.0)
    assert np.abs(run.signals / SIZE - wanted.get("lengths")).max() < 1e-13  # 0 here
    moved, speed = walker.motion
    free, state = body.free, alone.state
    assert np.abs(moved / SIZE - (state.positions - body.positions)[free].ravel()).max() < 1e-12
    assert np.abs(speed / (8 * SIZE) - state.velocities[free].ravel()).max() < 1e-12
    still = trot.stride.commands(np.array([[0.5, 0.5, -0.5, -0.5]]), np.zeros((1, 4)))
    run = walker.rollout(offset=np.tile(still, (8000, 1)), gate=0.0, record=("qpos",))
    hips = run.qpos[-1, -2 * len(LEGS) :: 2]
    assert hips == pytest.approx(still[0, 4:8], abs=0.02)  # the load bends the servos


def test_a_body_taught_on_the_ground_keeps_the_targets_pace(body, trot):
    """Coupled, with the readouts of a body that never bore loads, the stride is off by 3 %."""
    walker = started(body, trot, coupling=0.4)
    grounded = teach_on_ground(walker, trot, gait_target("trot"), 0, duration=30.0)
    assert grounded.nrmse < 0.02
    wanted = gait_target("trot").period / walker.pace
    periods = []
    for gait in (trot, grounded):
        walker.start(gait)
        walk = walker.walk(3.0)
        assert np.isinf(fall_times(walk, ROBOT.leg)).all()
        periods.append(stride_period(walk.after(1.5), wanted))
    assert abs(periods[0] / wanted - 1) > 0.01
    assert periods[1] == pytest.approx(wanted, rel=0.003)


def test_robots_begin_on_their_feet_with_bodies_in_motion(body, trot):
    walker = started(body, trot)
    n, first = trot.start.shape[1], walker.qpos
    walker.walk(0.5)
    motion = walker.motion
    two = Walker(body, ROBOT, copies=2)
    two.start(trot, np.array([trot.start, motion]))
    assert np.array_equal(two.motion, [trot.start, motion])
    assert np.array_equal(two.qpos[:, n:], np.tile(first[n:], (2, 1)))
    assert not two.qvel[:, n:].any()


def test_copies_and_states_put_back_give_the_same_bits(body, trot):
    one = started(body, trot, coupling=-0.4)
    first = one.walk(0.3)
    state = one.snapshot()
    rest = one.walk(0.3)
    two = started(body, trot, coupling=-0.4, copies=2)
    for walk in (first, rest):
        both = two.walk(0.3)
        for copy in (0, 1):
            assert np.array_equal(both.trunk[copy], walk.trunk[0])
            assert np.array_equal(both.outputs[copy], walk.outputs[0])
    two.restore(np.vstack([state, state]))
    assert np.array_equal(two.walk(0.3).trunk[1], rest.trunk[0])


def test_a_push_changes_the_momentum_by_its_impulse(body, trot):
    """In free fall: m dv = impulse, whatever the legs do."""
    walker = started(body, trot, copies=2)
    qpos = walker.qpos
    qpos[:, trot.start.shape[1] + 2] += 50.0
    walker.set_state(qpos)
    impulse = 30.0
    walker.walk(0.2, push=[[0.0, 0.0], [0.0, impulse]])
    model, momenta = walker.model, []
    for copy in (0, 1):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = walker.qpos[copy], walker.qvel[copy]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        momenta.append(ROBOT.mass * data.subtree_linvel[model.body("robot/trunk").id])
    assert np.abs(momenta[1] - momenta[0] - [0.0, impulse, 0.0]).max() < 1e-5 * impulse


def test_a_standing_robot_bears_its_weight(body, trot):
    walker = started(body, LegReadout(0 * trot.w_out, trot.start, trot.stride))
    walker.walk(3.0)
    weight = 9.81 * ROBOT.mass
    assert walker.walk(0.1).contact[0, -1].sum() == pytest.approx(weight, rel=1e-3)


def made_up(trunk, **arrays):
    """A walk of one copy with these poses (T, 7), sampled every 10 ms."""
    n = len(trunk)
    given = {"outputs": np.zeros((1, n, 4)), "contact": np.zeros((1, n, 4)),
             "power": np.zeros((1, n)), "net": np.zeros((1, n))} | arrays  # fmt: skip
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
                np.zeros((2, 800, 4)), *np.zeros((2, 2, 800)))  # fmt: skip
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
    with pytest.raises(InvalidArgumentError, match="body: expected 4 feedback channels"):
        Walker(replace(body, w_fb=body.w_fb[:, :2]), ROBOT)
    for push, name in (((1.0, 2.0, 3.0), "push"), (np.zeros((3, 2)), "push")):
        with pytest.raises(InvalidArgumentError, match=f"{name}: expected"):
            Walker(body, ROBOT).walk(0.1, push=push)
