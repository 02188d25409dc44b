"""Correction of a readout while it runs, against a plain loop of mj_step and textbook formulas."""

import copy

import mujoco
import numpy as np
import pytest

import mcmj
from mcmj.core.callbacks.online_learning import Learner
from mcmj.learning.recursive_regression import learner_after
from mcmj.learning.regression import Regression
from mcmj.simulation.corrected_run import Stretch, run_corrected
from mcmj.targets.limit_cycles import target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjError

CHAIN = """
<mujoco><option timestep="0.002" gravity="0 0 -2"/><worldbody>
<body><joint name="a" axis="0 1 0" stiffness="3" damping="0.2"/><geom size="0.05 0.3" type="capsule"
 pos="0 0 -0.3"/>
<body pos="0 0 -0.6"><joint name="b" axis="0 1 0" stiffness="2" damping="0.1"/>
<geom size="0.05 0.2" type="capsule" pos="0 0 -0.2"/><site name="tip" pos="0 0 -0.4"/></body></body>
</worldbody><actuator><motor name="p" joint="a" gear="2"/><motor name="q" joint="b"/></actuator>
<sensor><jointpos name="sa" joint="a"/><jointpos name="sb" joint="b"/>
<jointvel name="va" joint="a"/><accelerometer name="acc" site="tip"/></sensor></mujoco>
"""
STEPS, EVERY = 4000, 5


def chain(sensors=("s*", "v*"), **options):
    return mcmj.Reservoir(CHAIN, sensors=sensors, channels=["p", "q"], **options)


def body(**options):
    return mcmj.Simulation(mcmj.random_body(2, 8), **options)


def places(simulation):
    """Signals in sensordata, and the first actuator of the outputs."""
    model = simulation.model
    if isinstance(simulation, mcmj.Simulation):
        springs, inputs = simulation.body.n_springs, simulation.body.n_inputs
        return np.arange(model.nsensordata - springs, model.nsensordata), inputs
    names = [name.partition("[") for name in simulation.signal_names]
    places = [model.sensor(n).adr[0] + (int(i[:-1]) if i else 0) for n, _, i in names]
    return np.array(places), model.actuator("mcmj:output:p").id


def stretch(simulation, steps=STEPS, size=0.3):
    rhythm = target("van_der_pol")
    times = simulation.timestep * np.arange(steps)
    noise = size * np.random.default_rng(0).normal(size=(steps, 2))
    return Stretch(0.3 * rhythm.sample(times[::EVERY]), noise)


def learner_of(simulation, ridge=0.1):
    """From weights and means of no meaning; lengths are near what they are at rest."""
    rng, n = np.random.default_rng(1), len(places(simulation)[0])
    rest = simulation.body.rest_lengths if isinstance(simulation, mcmj.Simulation) else 0.0
    return Learner(
        np.eye(n + 1) / np.sqrt(ridge), 0.01 * rng.normal(size=(2, n + 1)),
        rest + 0.1 * rng.normal(size=n), rng.uniform(0.5, 2.0, n),
    )  # fmt: skip


def by_hand(simulation, learner, drive, gate, late=()):
    """The same run in Python: MuJoCo's own binding of mj_step, and P itself."""
    model, (signals, first) = copy.copy(simulation.model), places(simulation)
    model.actuator_biasprm[first : first + 2, 0] = gate
    data, n = mujoco.MjData(model), len(signals)
    inverse, weights = learner.root @ learner.root.T, learner.weights.T.copy()
    for k, offset in enumerate(drive.offset):
        w = weights[:n] * learner.inverse_spread[:, None]
        rows = np.vstack([w, weights[n] - learner.mean @ w])
        model.actuator_user[first : first + 2, : n + 1] = rows.T
        data.ctrl[first : first + 2] = offset
        before = data.sensordata[signals].copy()
        mujoco.mj_step(model, data)
        heard = np.where(np.isin(np.arange(n), late), before, data.sensordata[signals])
        if k % EVERY == 0:
            f = np.append((heard - learner.mean) * learner.inverse_spread, 1.0)
            gain = inverse @ f / (1.0 + f @ inverse @ f)
            weights = weights + np.outer(gain, drive.targets[k // EVERY] - f @ weights)
            inverse = inverse - np.outer(gain, f @ inverse)
    w = weights[:n] * learner.inverse_spread[:, None]
    return np.vstack([w, weights[n] - learner.mean @ w]), data


def state_of(simulation):
    """Positions and speeds of the joints after the run."""
    return np.append(simulation.qpos, simulation.qvel)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("make", [chain, body])
@pytest.mark.parametrize("gate", [0.0, 1.0])
def test_it_is_a_plain_loop_of_steps_and_corrections(make, integrator, gate):
    simulation = make(integrator=integrator)
    learner = learner_of(simulation)
    drive = stretch(simulation)
    rows, data = by_hand(simulation, copy.deepcopy(learner), drive, gate)
    run_corrected(simulation, learner, [drive], every=EVERY, gate=gate)
    assert np.abs(simulation.readout.rows - rows).max() < 1e-12 * np.abs(rows).max()
    assert np.abs(state_of(simulation) - np.append(data.qpos, data.qvel)).max() < 1e-13
    assert simulation.time == pytest.approx(data.time, rel=3e-12)


@pytest.mark.parametrize("late", [("acc",), ("actuatorfrc:p", "sb")])
def test_late_signals_are_learned_from_as_they_are_heard(late):
    simulation = chain(sensors=("sa", *late))
    n = len(simulation.signal_names)
    is_late = [i for i in range(1, n) if simulation.signal_names[i] != "sb"]
    learner, drive = learner_of(simulation), stretch(simulation)
    rows, data = by_hand(simulation, copy.deepcopy(learner), drive, 1.0, is_late)
    run_corrected(simulation, learner, [drive], every=EVERY)
    assert np.abs(simulation.readout.rows - rows).max() < 1e-12 * np.abs(rows).max()
    assert np.abs(state_of(simulation) - np.append(data.qpos, data.qvel)).max() < 1e-13


@pytest.mark.parametrize("make", [
    chain, body,
    lambda: chain(sensors=("sa", "acc")),
    lambda: chain(feedback_delay=3),
    lambda: body(substeps=2, feedback_delay=1),
    lambda: body(integrator="leapfrog"),
    lambda: body(springs="cubic"),
])  # fmt: skip
def test_without_corrections_it_is_a_rollout_bit_for_bit(make):
    """Two stretches from the middle of a run, and what comes after them."""
    one, other = make(), make()
    n = len(one.readout.rows) - 1
    w_out = 1e-4 * np.random.default_rng(3).normal(size=(n + 1, 2))
    for simulation in (one, other):
        simulation.set_readout(w_out)
        simulation.rollout(offset=stretch(simulation, 100, 0.1).offset)
    drives = [stretch(one, 500, 0.1), stretch(one, 300, 0.2)]
    for drive in drives:
        one.rollout(offset=drive.offset)
    still = Learner(np.zeros((n + 1, n + 1)), w_out.T.copy(), np.zeros(n), np.ones(n))
    run_corrected(other, still, drives, every=EVERY)
    assert other.readout.rows.tobytes() == w_out.tobytes()
    assert one.time == other.time
    after = [simulation.rollout(200, record=("outputs",)).outputs for simulation in (one, other)]
    assert after[0].tobytes() == after[1].tobytes()
    assert after[0].std() > 0


def test_inputs_reach_the_model():
    one, other = (mcmj.Reservoir(CHAIN, sensors="s*", channels=["p"], inputs=["q"]) for _ in "12")
    inputs, offset = 0.2 * np.ones((50, 1)), np.zeros((50, 1))
    one.rollout(inputs=inputs, offset=offset, gate=0.0)
    still = Learner(np.zeros((3, 3)), np.zeros((1, 3)), np.zeros(2), np.ones(2))
    run_corrected(other, still, [Stretch(np.zeros((10, 1)), offset, inputs)], every=5)
    assert state_of(one).tobytes() == state_of(other).tobytes()
    assert state_of(one).any()


@pytest.mark.parametrize("make", [chain, body])
def test_under_a_teacher_it_is_ridge_regression_of_the_same_samples(make):
    """First samples by a batch, the others one by one."""
    simulation, ridge = make(), 1e-2
    drive = stretch(simulation)
    run = simulation.rollout(offset=drive.offset, gate=0.0)
    signals, half = run.get("lengths")[::EVERY], len(drive.targets) // 2
    first = Regression(bias=True)
    first.add(signals[:half], drive.targets[:half])
    learner = learner_after(first, ridge)
    simulation.reset()
    parts = [
        Stretch(drive.targets[at : at + half], drive.offset[EVERY * at : EVERY * (at + half)])
        for at in (0, half)
    ]
    simulation.rollout(offset=parts[0].offset, gate=0.0)
    run_corrected(simulation, learner, parts[1:], every=EVERY, gate=0.0)
    mean, spread = signals[:half].mean(axis=0), signals[:half].std(axis=0)
    assert learner.mean == pytest.approx(mean, rel=1e-12, abs=1e-12)
    assert learner.inverse_spread == pytest.approx(1.0 / spread, rel=1e-9)
    features = np.column_stack([(signals - mean) / spread, np.ones(len(signals))])
    penalty = ridge * np.diag([*np.ones(len(mean)), 0.0])
    w = np.linalg.solve(features.T @ features + penalty, features.T @ drive.targets)
    assert np.abs(learner.weights.T - w).max() < 1e-8 * np.abs(w).max()


@pytest.mark.parametrize("make", [chain, body])
@pytest.mark.parametrize("autoreset", [True, False])
def test_a_blow_up_says_when_and_leaves_the_simulation_where_it_was(make, autoreset):
    simulation = make()
    if not autoreset:
        simulation.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    simulation.rollout(50, offset=stretch(simulation, 50).offset, gate=0.0)
    before, learner = simulation.snapshot(), learner_of(simulation)
    drives = [stretch(simulation, 100), stretch(simulation, 1000, 1e12)]
    drives[1].offset[:300] = 0.0
    with pytest.raises(DivergenceError, match="while it learned") as caught:
        run_corrected(simulation, learner, drives, every=EVERY)
    assert 400 <= caught.value.steps_done < 450
    step = simulation.timestep
    assert caught.value.time == pytest.approx((50 + caught.value.steps_done) * step, abs=1e-14)
    assert np.array_equal(simulation.snapshot(), before)
    assert not simulation.readout.rows.any()


def test_a_readout_that_blows_up_ends_the_run():
    simulation = chain()
    drive = stretch(simulation)
    drive.targets[100] = np.inf
    with pytest.raises(DivergenceError) as caught:
        run_corrected(simulation, learner_of(simulation), [drive], every=EVERY)
    assert caught.value.steps_done == 500


def test_the_twin_is_refused_and_there_is_one_drive_at_a_time():
    twin = body(engine="twin")
    with pytest.raises(InvalidArgumentError, match="engine"):
        run_corrected(twin, learner_of(body()), [stretch(twin)], every=EVERY)
    simulation = chain()
    begun = simulation.stream(100, chunk=10)
    next(begun)
    with pytest.raises(McmjError, match="not at its end"):
        run_corrected(simulation, learner_of(simulation), [stretch(simulation)], every=EVERY)
