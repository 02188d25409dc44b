"""Every task that comes with mcmj as an environment: dm_env's and Gymnasium's own checks."""

import unittest
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dm_control", reason="the extra 'control' is not installed")

from absl.testing import absltest
from dm_env import test_utils

import mcmj
from mcmj.learning.environments import environment
from mcmj.learning.environments.environment import Setting
from mcmj.learning.environments.tasks import assign
from mcmj.targets.input_systems import QUADRATIC
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

SHORT = Setting(start="rest", time_limit=0.2)
TASKS = environment.all_tasks()
every_task = pytest.mark.parametrize(("name", "task"), TASKS)


def test_limit_cycles_gaits_and_driven_rhythms_are_tasks():
    assert {("quadratic", "quadratic"), ("gaits", "bound"), ("input_driven", "eps=0.2")} <= set(
        TASKS
    )
    assert len(TASKS) == 3 + 4 + 3 + 4  # a designed body has one


@every_task
def test_dm_env_checks_the_interface(name, task):
    """Episodes of 10 control steps end within it."""

    class Contract(test_utils.EnvironmentTestMixin, absltest.TestCase):
        def make_object_under_test(self):
            return environment.load(name, task, SHORT, random=0)

    result = unittest.TestResult()
    unittest.TestLoader().loadTestsFromTestCase(Contract).run(result)
    assert result.testsRun == 4
    assert result.wasSuccessful(), result.failures + result.errors


@pytest.mark.parametrize(("name", "task"), [("gaits", "bound"), ("input_driven", "eps=1")])
def test_without_action_the_body_stays_on_its_cycle(name, task):
    """Orbit and phase: the outputs are where the target is after 1.2 periods, its loop closed."""
    env = environment.load(name, task, Setting(gate=1.0, kick=0.0))
    env.reset()
    idle = np.zeros(env.action_spec().shape)
    for _ in range(round(1.2 * env.task.target.period / 0.02)):
        step = env.step(idle)
    assert step.reward > 0.95
    assert np.abs(step.observation["outputs"] - step.observation["target"]).max() < 0.05


@every_task
def test_gymnasium_checks_the_environment(name, task):
    gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(
        "mcmj.learning.environments.gymnasium_env:mcmj/Orbit-v0",
        name=name,
        task=task,
        setting=SHORT,
    )
    check_env(env.unwrapped)
    observation, _ = env.reset(seed=4)
    ends = [env.step(env.action_space.sample())[2:4] for _ in range(10)]
    assert ends == [(False, False)] * 9 + [(False, True)]
    again, _ = env.reset(seed=4)
    assert all(np.array_equal(observation[key], again[key]) for key in observation)
    env.close()


def test_gymnasium_takes_shares_of_the_largest_actions():
    pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
    from mcmj.learning.environments.gymnasium_env import OrbitEnv

    env = OrbitEnv("input_driven", "eps=5", replace(SHORT, input_limit=3.0))
    env.reset(seed=0)
    env.step(np.array([-1.0, 0.5, 1.0]))
    largest = 2 * np.abs(env.environment.task.target.orbit(4096)).max()
    np.testing.assert_array_equal(env.environment.physics.data.ctrl, [2.0, 0.5 * largest, largest])


def test_an_input_is_held_and_the_agents_comes_on_top():
    env = environment.load("input_driven", "eps=0.2", replace(SHORT, input_limit=0.1))
    env.reset()
    env.step([0.05, 0.0, 0.0])
    np.testing.assert_array_equal(env.physics.data.ctrl, [0.25, 0.0, 0.0])
    assert env.task.target is QUADRATIC.cycle(0.2)


def test_a_task_without_a_readout_is_taught(tmp_path):
    path = tmp_path / "mine.xml"
    path.write_text(mcmj.to_mjcf(mcmj.random_body(0, nodes=12)))
    given = assign(str(path))
    assert given.target is mcmj.target("van_der_pol")
    body, w_out = given.simulation.body, given.simulation.w_out
    fit = mcmj.teach(mcmj.Simulation(body), given.target, mcmj.Teaching(), seed=0)
    np.testing.assert_array_equal(w_out, fit.w_out)


def test_a_task_that_a_body_cannot_do_is_refused(tmp_path):
    with pytest.raises(UnknownNameError, match="valid choices: bound, pace, trot, walk"):
        environment.load("gaits", "quadratic")
    with pytest.raises(UnknownNameError, match="choices: lissajous, quadratic, van_der_pol"):
        environment.load("general", "eps=1")
    path = tmp_path / "three.xml"
    path.write_text(mcmj.to_mjcf(mcmj.random_body(0, nodes=8, n_outputs=3)))
    with pytest.raises(InvalidArgumentError, match="2 outputs, or 4 for gaits"):
        environment.load(str(path))
