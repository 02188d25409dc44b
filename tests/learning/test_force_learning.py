"""FORCE learning: bodies and MuJoCo models that are right about what they do by themselves."""

import numpy as np
import pytest

import mcmj
from mcmj.learning.force_learning import ForceLearning, force_learn
from mcmj.learning.free_run import trial_error
from mcmj.metrics.orbits import orbit_error
from mcmj.targets.limit_cycles import target
from mcmj.utils.errors import DivergenceError, InvalidArgumentError

SHORT = ForceLearning(
    warm_up=30.0, washout=10.0, noise=0.05, rounds=2, round_duration=30.0, trial=30.0
)


def masses(n=10):
    """Masses on a rail each, springs to the world and to each other, stiffening ones."""
    joints = "".join(
        f'<body><joint name="x{i}" type="slide" axis="1 0 0" stiffness="{1 + i} 0 {30 + 10 * i}" '
        f'damping="{0.3 + 0.1 * i} 0 {2 + i}"/><geom size="0.1" mass="1" contype="0"/></body>'
        for i in range(n)
    )
    springs = "".join(
        f'<fixed stiffness="2 0 20" damping="0.2"><joint joint="x{i}" coef="1"/>'
        f'<joint joint="x{i + 1}" coef="-1"/></fixed>'
        for i in range(n - 1)
    )
    motors = "".join(f'<motor name="m{i}" joint="x{i}"/>' for i in range(n))
    return (
        f'<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>{joints}</worldbody>'
        f"<tendon>{springs}</tendon><actuator>{motors}</actuator></mujoco>"
    )


def rails(n=10, **options):
    rng = np.random.default_rng(0)
    channels = {
        name: {f"m{i}": float(g) for i, g in enumerate(rng.uniform(-2, 2, n))} for name in "ab"
    }
    sensors = ["jointpos:*", "jointvel:*"]
    return mcmj.Reservoir(masses(n), sensors=sensors, channels=channels, **options)


@pytest.mark.parametrize("make", [lambda: mcmj.Simulation(mcmj.random_body(1, 25)), rails])
def test_it_learns_a_rhythm_and_is_left_in_it(make):
    simulation, rhythm, steps = make(), target("quadratic"), []
    learned = force_learn(simulation, rhythm, SHORT, seed=1, on_steps=steps.append)
    assert min(learned.errors) < 0.05
    assert simulation.readout.rows.tobytes() == learned.w_out.tobytes()
    assert np.array_equal(simulation.snapshot(), learned.state)
    run = simulation.rollout(round(60.0 / simulation.timestep), record=("outputs",))
    assert orbit_error(run.get("outputs")[len(run) // 2 :], rhythm) < 0.05
    count = len(learned.errors)
    seconds = SHORT.warm_up + count * (SHORT.round_duration + SHORT.trial)
    assert sum(steps) == pytest.approx(seconds / simulation.timestep)
    assert seconds <= SHORT.total


def test_the_best_round_counts_and_the_same_seed_gives_the_same_bits():
    found = []
    for _ in range(2):
        simulation = rails()
        learned = force_learn(simulation, target("van_der_pol"), SHORT, seed=3)
        error = trial_error(simulation, target("van_der_pol"), SHORT.trial)
        assert error == pytest.approx(min(learned.errors), rel=1e-12)
        found.append(learned.w_out)
    assert found[0].tobytes() == found[1].tobytes()


def test_without_rounds_it_is_the_ridge_regression_under_the_teacher():
    simulation, rhythm = rails(), target("quadratic")
    learning = ForceLearning(warm_up=30.0, washout=10.0, noise=0.0, rounds=0, ridge=1e-2)
    learned = force_learn(simulation, rhythm, learning, seed=0)
    other = rails()
    times = other.timestep * np.arange(15000)
    ramp = np.minimum(1.0, times)[:, None]
    signals = other.rollout(offset=ramp * rhythm.sample(times), gate=0.0).get("lengths")
    chosen, wanted = signals[5000::2], rhythm.sample(times[5000::2])  # 5 ms: two steps
    mean, spread = chosen.mean(axis=0), chosen.std(axis=0)
    features = np.column_stack([(chosen - mean) / spread, np.ones(len(chosen))])
    penalty = 1e-2 * np.diag([*np.ones(len(mean)), 0.0])
    w = np.linalg.solve(features.T @ features + penalty, features.T @ wanted)
    outputs = np.column_stack([signals, np.ones(len(signals))]) @ learned.w_out
    expected = np.column_stack([(signals - mean) / spread, np.ones(len(signals))]) @ w
    assert np.abs(outputs - expected)[5000:].max() < 2e-12
    assert learned.errors == ()


def test_after_a_trial_that_fails_the_teacher_leads_again_from_the_start():
    simulation, stood = rails(), []

    def stand():
        simulation.reset()
        stood.append(simulation.time)

    def judge():
        return trial_error(
            simulation, target("quadratic"), SHORT.trial,
            lambda run: len(stood) == 1 and run.get("qpos").shape[1] == 10,
        )  # fmt: skip

    learned = force_learn(simulation, target("quadratic"), SHORT, seed=1, stand=stand, judge=judge)
    assert len(stood) == 2
    assert np.isinf(learned.errors[0])
    assert learned.errors[1] < 0.05


def test_it_may_begin_at_a_snapshot():
    simulation = rails()
    simulation.rollout(500, offset=np.ones((500, 2)), gate=0.0)
    start = simulation.snapshot()
    simulation.reset()
    learning = ForceLearning(rounds=1, round_duration=1.0, trial=20.0)
    learned = force_learn(simulation, target("quadratic"), learning, seed=1, stand=start)
    assert simulation.time == pytest.approx(1.0 + learning.warm_up + 1.0)
    assert len(learned.errors) == 1


def test_what_blows_up_at_once_says_so():
    with pytest.raises(DivergenceError):
        force_learn(rails(timestep=0.5), target("quadratic"), SHORT, seed=0)


def test_the_twin_is_refused():
    twin = mcmj.Simulation(mcmj.random_body(1, 8), engine="twin")
    with pytest.raises(InvalidArgumentError, match="engine: expected 'mujoco'"):
        force_learn(twin, target("quadratic"), SHORT, seed=0)


@pytest.mark.parametrize(
    "change",
    [{"period": 0.0}, {"ridge": 0.0}, {"rounds": -1}, {"washout": 6.0}, {"noise": np.nan},
     {"trial": -1.0}],
)  # fmt: skip
def test_settings_name_what_is_wrong(change):
    with pytest.raises(InvalidArgumentError, match=next(iter(change))):
        ForceLearning(**change)
