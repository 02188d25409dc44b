"""Bodies as dm_control and Gymnasium environments: contract, physics, reward, determinism."""

import numpy as np
import pytest

pytest.importorskip("dm_control", reason="the extra 'control' is not installed")

from absl.testing import absltest
from dm_env import test_utils

import mcmj
from mcmj import environment, metrics
from mcmj.environment import Setting
from mcmj.errors import InvalidArgumentError, UnknownNameError
from mcmj.experiments import drive
from mcmj.orbit_window import OrbitWindow

SHORT = Setting(time_limit=0.2)


class ContractTest(test_utils.EnvironmentTestMixin, absltest.TestCase):
    """dm_env's own test of the interface; episodes of 10 control steps end within it."""

    def make_object_under_test(self):
        return environment.load("van_der_pol", setting=SHORT, random=0)


@pytest.fixture(scope="module")
def one():
    """A small body with inputs, its loop closed, both kinds of actions."""
    body = mcmj.random_body(1, nodes=8, n_inputs=2, masses=(0.5, 2.0))
    w_out = 0.05 * np.random.default_rng(0).normal(size=(body.n_springs + 1, 2))
    setting = Setting(kick=0.0, time_limit=1.0, input_limit=3.0, offset_limit=2.0)
    return environment.make(body, w_out, mcmj.target("lissajous"), setting, random=3)


def actions_of(env, count, seed=0):
    spec = env.action_spec()
    return np.random.default_rng(seed).uniform(spec.minimum, spec.maximum, (count, *spec.shape))


def test_the_physics_is_our_closed_loop(one):
    physics, actions = one.physics, actions_of(one, 30)
    steps = [one.reset(), *(one.step(action) for action in actions)]
    held = np.repeat(actions, 20, axis=0)
    simulation = mcmj.Simulation(physics.body, w_out=physics.w_out)
    run = simulation.rollout(inputs=held[:, :2], offset=held[:, 2:])
    end = simulation.rollout(1)
    seen = np.array([step.observation["lengths"] for step in steps])
    wanted = np.vstack([run.lengths[::20], end.lengths])
    assert np.array_equal(seen, wanted)
    assert np.abs(wanted - wanted[0]).max() > 0.1  # it did move
    outputs = np.array([step.observation["outputs"] for step in steps])
    assert np.abs(outputs - np.vstack([run.outputs[::20], end.outputs])).max() < 2e-14


def test_the_gate_opens_the_loop(one):
    body, w_out = one.physics.body, one.physics.w_out
    open_loop = environment.make(
        body, w_out, mcmj.target("lissajous"), Setting(kick=0.0, gate=0.0, time_limit=1.0)
    )
    open_loop.reset()
    step = open_loop.step(np.zeros(4))
    assert np.array_equal(step.observation["lengths"], open_loop.reset().observation["lengths"])


def test_actions_are_bounded_in_order_and_clipped(one):
    spec = one.action_spec()
    assert np.array_equal(spec.maximum, [3.0, 3.0, 2.0, 2.0])
    one.reset()
    one.step(100 * spec.maximum)
    assert np.array_equal(one.physics.data.ctrl, spec.maximum)
    body, w_out = one.physics.body, one.physics.w_out
    only = environment.make(body, w_out, mcmj.target("lissajous"), Setting(actions="offsets"))
    assert only.action_spec().shape == (2,)


def test_the_same_seed_gives_the_same_episodes():
    def episodes(seed):
        env = environment.load("van_der_pol", setting=SHORT, random=seed)
        found = []
        for action in actions_of(env, 25):
            step = env.step(action)
            found.append(np.concatenate([*step.observation.values(), [step.reward or 0.0]]))
        return np.array(found)

    assert np.array_equal(episodes(1), episodes(1))
    assert not np.array_equal(episodes(1), episodes(2))


def test_reward_is_1_on_the_cycle_and_small_without_motion():
    env = environment.load("quadratic", setting=Setting(start="cycle", kick=0.0))
    env.reset()
    period = env.task.target.period
    for _ in range(round(1.2 * period / 0.02)):
        step = env.step(np.zeros(2))
    assert step.reward == 1.0
    assert np.abs(step.observation["outputs"] - step.observation["target"]).max() < 0.05
    body, w_out = env.physics.body, np.zeros_like(env.physics.w_out)
    still = environment.make(body, w_out, env.task.target, Setting(kick=0.0))
    still.reset()
    assert still.step(np.zeros(2)).reward == pytest.approx(0.1**0.95**2, rel=0.1)


def test_orbit_window_is_the_orbit_error():
    wanted = mcmj.target("van_der_pol")
    window, interval = OrbitWindow(wanted, 0.01), 0.01
    times = interval * np.arange(2000)
    outputs = 1.1 * wanted.sample(times) + [0.2, -0.1]
    assert window.error == np.inf
    for sample in outputs:
        window.add(sample)
    last = outputs[-round(wanted.period / interval) :]
    assert window.error == pytest.approx(metrics.orbit_error(last, wanted), rel=2e-3)


@pytest.mark.parametrize("weight", [1e4, 0.3])  # blows up at once; runs away first
def test_a_body_that_is_lost_ends_the_episode(one, weight):
    body = one.physics.body
    w_out = weight * np.ones((body.n_springs, 2)) * [1.0, -1.0]
    env = environment.make(body, w_out, mcmj.target("lissajous"), Setting())
    env.reset()
    step = env.step(np.zeros(4))
    assert (step.last(), step.discount) == (True, 0.0)
    assert step.reward == 0.0
    assert env.physics.blew_up == (weight == 1e4)
    for name, spec in env.observation_spec().items():
        spec.validate(step.observation[name])
    assert env.step(np.zeros(4)).first()
    assert not env.physics.blew_up


def test_every_body_with_a_readout_is_a_task():
    names = environment.all_tasks()
    assert ("quadratic", "quadratic") in names
    for name, task in names:
        env = environment.load(name, task, SHORT, random=0)
        assert np.isfinite(env.step(None).observation["outputs"]).all()


def test_what_does_not_fit_is_said(one):
    with pytest.raises(UnknownNameError, match=r"valid choices: .*quadratic"):
        environment.load("nobody")
    with pytest.raises(UnknownNameError, match="both, inputs, offsets"):
        Setting(actions="forces")
    with pytest.raises(InvalidArgumentError, match="actions: expected channels"):
        environment.load("quadratic", setting=Setting(actions="inputs"))
    with pytest.raises(InvalidArgumentError, match="w_out"):
        environment.make(one.physics.body, np.zeros((3, 2)), mcmj.target("lissajous"))


def test_gymnasium_checks_the_environment():
    gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("mcmj.gymnasium_env:mcmj/Orbit-v0", name="van_der_pol", setting=SHORT)
    check_env(env.unwrapped)
    observation, _ = env.reset(seed=4)
    ends = [env.step(env.action_space.sample())[2:4] for _ in range(10)]
    assert ends == [(False, False)] * 9 + [(False, True)]
    again, _ = env.reset(seed=4)
    assert all(np.array_equal(observation[key], again[key]) for key in observation)
    env.close()


def test_the_cross_entropy_method_finds_better_inputs():
    config = drive.Config(
        task="van_der_pol", seed=2, population=4, elites=2, rounds=2, time_limit=12.0
    )
    result = drive.run(config)
    assert result.rewards.shape == (2, 4)
    assert result.after.mean_reward == result.rewards.max()  # deterministic: played again
    assert result.after.mean_reward > result.before.mean_reward
