"""Environments: their physics, actions, reward and determinism."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dm_control", reason="the extra 'control' is not installed")

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.drive import run as drive
from mcmj.learning.environments import environment
from mcmj.learning.environments.environment import Setting
from mcmj.learning.teaching import synchronise
from mcmj.metrics import orbits
from mcmj.metrics.orbit_window import OrbitWindow
from mcmj.utils.errors import InvalidArgumentError, StabilityWarning, UnknownNameError

SHORT = Setting(time_limit=0.2)


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


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_physics_is_our_closed_loop(one, integrator):
    physics, setting = one.physics, replace(one.task.setting, integrator=integrator)
    env = environment.make(physics.body, physics.w_out, one.task.target, setting)
    actions = actions_of(env, 30)
    steps = [env.reset(), *(env.step(action) for action in actions)]
    held = np.repeat(actions, 20, axis=0)
    simulation = mcmj.Simulation(physics.body, w_out=physics.w_out, integrator=integrator)
    run = simulation.rollout(inputs=held[:, :2], offset=held[:, 2:])
    end = simulation.rollout(1)
    seen = np.array([step.observation["lengths"] for step in steps])
    wanted = np.vstack([run.lengths[::20], end.lengths])
    assert np.array_equal(seen, wanted)
    assert np.abs(wanted - wanted[0]).max() > 0.1  # it did move
    outputs = np.array([step.observation["outputs"] for step in steps])
    assert np.abs(outputs - np.vstack([run.outputs[::20], end.outputs])).max() < 2e-14


@pytest.mark.parametrize("integrator", ["RK4", "leapfrog"])
def test_an_episode_on_the_cycle_goes_on_under_its_integrator(one, integrator):
    """As a Simulation does that is put there, without action, constant input held."""
    body, w_out, wanted = one.physics.body, one.physics.w_out, one.task.target
    setting = replace(one.task.setting, integrator=integrator, start="cycle")
    env = environment.make(body, w_out, wanted, setting, inputs=[0.3, -0.2])
    steps = [env.reset(), *(env.step(np.zeros(4)) for _ in range(10))]
    simulation = mcmj.Simulation(body, integrator=integrator)
    synchronise(simulation, wanted, 20.0, [0.3, -0.2])
    simulation.set_readout(w_out)
    state = simulation.state
    simulation.set_state(state.positions, state.velocities)
    run = simulation.rollout(inputs=np.tile([0.3, -0.2], (201, 1)))
    seen = np.array([step.observation["lengths"] for step in steps])
    assert np.array_equal(seen, run.lengths[::20])
    assert np.abs(seen - seen[0]).max() > 0.01


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
    assert window.error == pytest.approx(orbits.orbit_error(last, wanted), rel=2e-3)


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


def test_what_does_not_fit_is_said(one):
    with pytest.raises(UnknownNameError, match=r"valid choices: .*quadratic"):
        environment.load("nobody")
    with pytest.raises(UnknownNameError, match="both, inputs, offsets"):
        Setting(actions="forces")
    with pytest.raises(InvalidArgumentError, match="actions: expected channels"):
        environment.load("quadratic", setting=Setting(actions="inputs"))
    with pytest.raises(InvalidArgumentError, match="w_out"):
        environment.make(one.physics.body, np.zeros((3, 2)), mcmj.target("lissajous"))
    with pytest.raises(UnknownNameError, match="integrator 'Verlet'; valid choices: Euler, RK4, "):
        Setting(integrator="Verlet")
    with pytest.raises(InvalidArgumentError, match="control_timestep: expected a multiple of"):
        Setting(control_timestep=0.0205)
    body, w_out = one.physics.body, one.physics.w_out
    with pytest.raises(InvalidArgumentError, match="inputs: expected shape \\(2\\)"):
        environment.make(body, w_out, mcmj.target("lissajous"), inputs=[1.0])
    coarse = Setting(timestep=0.5, control_timestep=0.5, integrator="leapfrog")
    with pytest.warns(StabilityWarning, match="integrator leapfrog"):
        environment.make(body, w_out, mcmj.target("lissajous"), coarse)


def test_the_cross_entropy_method_finds_better_inputs():
    config = drive.Config(
        task="van_der_pol", seed=2, population=4, elites=2, rounds=2, time_limit=12.0
    )
    result = drive.run(config)
    assert result.rewards.shape == (2, 4)
    assert result.after.mean_reward == result.rewards.max()  # deterministic: played again
    assert result.after.mean_reward > result.before.mean_reward
