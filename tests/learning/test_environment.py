"""Environments: their physics, actions, reward and determinism."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dm_control", reason="the extra 'control' is not installed")

from models import CHAIN, CHAIN_PARTS

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.drive import run as drive
from mcmj.learning.environments import environment, tasks
from mcmj.learning.environments.environment import Setting
from mcmj.learning.teaching import synchronise
from mcmj.targets.limit_cycles import from_array
from mcmj.targets.named import named_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

SHORT = Setting(start="rest", time_limit=0.2)
BESIDE = Setting(start="rest", kick=0.0, gate=1.0, time_limit=1.0)  # the loop is closed already


@pytest.fixture(scope="module")
def one():
    """A small body with inputs, its loop closed, both kinds of actions."""
    body = mcmj.random_body(1, nodes=8, n_inputs=2, masses=(0.5, 2.0))
    w_out = 0.05 * np.random.default_rng(0).normal(size=(body.n_springs + 1, 2))
    setting = replace(BESIDE, input_limit=3.0)
    simulation = mcmj.Simulation(body, w_out=w_out)
    return environment.make(simulation, mcmj.target("lissajous"), setting, random=3)


def parts(env):
    """The body and its readout."""
    return env.physics.reservoir.body, env.physics.reservoir.w_out


def actions_of(env, count, seed=0):
    spec = env.action_spec()
    return np.random.default_rng(seed).uniform(spec.minimum, spec.maximum, (count, *spec.shape))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_physics_is_our_closed_loop(one, integrator):
    body, w_out = parts(one)
    simulation = mcmj.Simulation(body, w_out=w_out, integrator=integrator, engine="tendons")
    env = environment.make(
        mcmj.Simulation(body, w_out=w_out, integrator=integrator),
        one.task.target,
        one.task.setting,
    )
    actions = actions_of(env, 30)
    steps = [env.reset(), *(env.step(action) for action in actions)]
    held = np.repeat(actions, 20, axis=0)
    run = simulation.rollout(inputs=held[:, :2], offset=held[:, 2:])
    end = simulation.rollout(1)
    seen = np.array([step.observation["signals"] for step in steps])
    wanted = np.vstack([run.lengths[::20], end.lengths])
    assert np.array_equal(seen, wanted)
    assert np.abs(wanted - wanted[0]).max() > 0.1  # it did move
    outputs = np.array([step.observation["outputs"] for step in steps])
    assert np.abs(outputs - np.vstack([run.outputs[::20], end.outputs])).max() < 2e-14


@pytest.mark.parametrize("integrator", ["RK4", "leapfrog"])
def test_an_episode_on_the_cycle_goes_on_under_its_integrator(one, integrator, monkeypatch):
    """As a Simulation does that is put there, without action, constant input held."""
    (body, w_out), wanted = parts(one), one.task.target
    monkeypatch.setattr(tasks, "PHASES", 1)
    setting = replace(one.task.setting, start="cycle")
    simulation = mcmj.Simulation(body, w_out=w_out, integrator=integrator)
    env = environment.make(simulation, wanted, setting, inputs=[0.3, -0.2])
    steps = [env.reset(), *(env.step(np.zeros(4)) for _ in range(10))]
    simulation = mcmj.Simulation(body, integrator=integrator, engine="tendons")
    synchronise(simulation, wanted, 20.0, [0.3, -0.2])
    simulation.set_readout(w_out)
    run = simulation.rollout(inputs=np.tile([0.3, -0.2], (201, 1)))
    seen = np.array([step.observation["signals"] for step in steps])
    assert np.array_equal(seen, run.lengths[::20])
    assert np.abs(seen - seen[0]).max() > 0.01


def test_the_gate_opens_the_loop(one):
    body, w_out = parts(one)
    open_loop = environment.make(
        mcmj.Simulation(body, w_out=w_out),
        mcmj.target("lissajous"),
        replace(BESIDE, gate=0.0),
    )
    open_loop.reset()
    step = open_loop.step(np.zeros(4))
    assert np.array_equal(step.observation["signals"], open_loop.reset().observation["signals"])


def test_actions_are_bounded_in_order_and_clipped(one):
    spec = one.action_spec()
    assert np.array_equal(spec.maximum, [3.0, 3.0, 2.0, 2.0])
    one.reset()
    one.step(100 * spec.maximum)
    assert np.array_equal(one.physics.data.ctrl, spec.maximum)
    simulation = one.physics.reservoir
    only = environment.make(simulation, mcmj.target("lissajous"), Setting(actions="offsets"))
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


def test_reward_is_1_on_the_cycle_at_its_pace_and_small_without_motion():
    env = environment.load("quadratic", setting=Setting(gate=1.0, kick=0.0))
    env.reset()
    rewards = [env.step(np.zeros(2)).reward for _ in range(400)]
    assert min(rewards) > 0.95  # the readout is off the orbit by so little
    body, w_out = parts(env)
    silent = mcmj.Simulation(body, w_out=0 * w_out)
    still = environment.make(silent, env.task.target, Setting(start="rest", kick=0.0))
    still.reset()
    assert 0.0 < still.step(np.zeros(2)).reward < 0.1 ** (1 / 0.5**2)


def test_episodes_start_all_round_the_cycle():
    """The times of the starts, modulo the period, are 16 phases; seeds pick them."""
    env = environment.load("quadratic", setting=Setting(time_limit=0.2))
    period, times = env.task.target.period, []
    for seed in range(60):
        env.task.reseed(seed)
        env.reset()
        times.append(env.physics.time() - 20.0)
    phases = np.unique(np.round(16 * np.array(times) / period))
    assert len(phases) > 12
    assert (np.min(times), np.max(times)) == pytest.approx(
        (0.0, period * 15 / 16), abs=1.1 * period / 16
    )


def test_nothing_and_anything_fail_where_the_readout_succeeds():
    """The agent closes the loop at 50 Hz; python scripts/environment_scores.py has every task."""
    setting = Setting(time_limit=10.0)
    env = environment.load("quadratic", setting=setting)
    policies = [lambda seen, draw: np.zeros(2), lambda seen, draw: draw, lambda seen, draw: seen]
    scores = []
    for policy in policies:
        env.task.reseed(0)
        step, rewards = env.reset(), []
        for draw in actions_of(env, 500):
            step = env.step(policy(step.observation["outputs"], draw))
            rewards.append(step.reward)
        assert step.last()
        scores.append(np.mean(rewards))
    assert max(scores[:2]) < 0.15
    assert scores[2] > 0.95


@pytest.mark.parametrize("weight", [1e4, 0.3])  # blows up at once; runs away first
def test_a_body_that_is_lost_ends_the_episode(one, weight):
    body, _ = parts(one)
    w_out = weight * np.ones((body.n_springs, 2)) * [1.0, -1.0]
    simulation = mcmj.Simulation(body, w_out=w_out, integrator="Euler")
    env = environment.make(simulation, mcmj.target("lissajous"), replace(BESIDE, kick=0.01))
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
    with pytest.raises(InvalidArgumentError, match="reservoir: expected 4 feedback"):
        environment.make(one.physics.reservoir, named_target("trot"))
    simulation, goal = one.physics.reservoir, mcmj.target("lissajous")
    with pytest.raises(InvalidArgumentError, match="control_timestep: expected a multiple of"):
        environment.make(simulation, goal, Setting(control_timestep=0.0205))
    with pytest.raises(InvalidArgumentError, match="inputs: expected shape \\(2\\)"):
        environment.make(simulation, goal, inputs=[1.0])
    twin = mcmj.Simulation(simulation.body, w_out=simulation.w_out, engine="twin")
    with pytest.raises(InvalidArgumentError, match="engine: expected 'mujoco'"):
        environment.make(twin, goal)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_any_model_is_an_environment(integrator):
    """Its episodes are its rollouts; the agent acts on an input and on what is fed back."""
    w_out = np.random.default_rng(0).normal(size=(5, 1)) / 20
    channels = {"y": {"m1": 1.0, "m2": -0.5}}
    reservoir = mcmj.Reservoir(
        CHAIN, sensors=CHAIN_PARTS["sensors"], channels=channels, inputs=["m2"], w_out=w_out,
        integrator=integrator,
    )  # fmt: skip
    goal = from_array("sine", np.sin(np.linspace(0, 6.28, 100))[:, None], 0.01)
    env = environment.make(reservoir, goal, BESIDE)
    actions = 0.1 * actions_of(env, 30)
    steps = [env.reset(), *(env.step(action) for action in actions)]
    held = np.repeat(actions, 10, axis=0)
    run = reservoir.rollout(inputs=held[:, :1], offset=held[:, 1:])
    seen = np.array([step.observation["signals"] for step in steps])
    wanted = np.vstack([run.signals[::10], reservoir.signals])
    assert np.array_equal(seen, wanted)
    assert np.abs(wanted[-1]).max() > 0.1


def test_the_cross_entropy_method_finds_better_inputs():
    config = drive.Config(
        task="van_der_pol", seed=2, population=4, elites=2, rounds=2, time_limit=12.0
    )
    result = drive.run(config)
    assert result.rewards.shape == (2, 4)
    assert result.after.mean_reward == result.rewards.max()  # deterministic: played again
    assert result.after.mean_reward > result.before.mean_reward


def test_a_reservoirs_file_is_an_environment(tmp_path):
    w_out = np.random.default_rng(0).normal(size=(5, 2)) / 50
    reservoir = mcmj.Reservoir(CHAIN, **CHAIN_PARTS, w_out=w_out)
    (tmp_path / "chain.xml").write_text(reservoir.to_mjcf())
    again = mcmj.Reservoir.open(tmp_path / "chain.xml")
    goal = mcmj.target("lissajous")
    env = environment.make(again, goal, BESIDE)
    actions = 0.1 * actions_of(env, 20)
    steps = [env.reset(), *(env.step(action) for action in actions)]
    run = reservoir.rollout(offset=np.repeat(actions, 10, axis=0))
    seen = np.array([step.observation["outputs"] for step in steps[:-1]])
    assert np.abs(seen - run.outputs[::10]).max() < 1e-14
    assert np.abs(seen).max() > 1e-3
