"""What doing nothing, random actions and a trained readout score in every environment.

    python scripts/environment_scores.py --seeds 10

The readout as the policy feeds back what it says of the signals, at every control step: the agent
closes the loop. Scores are mean rewards of an episode, 0 for what is left of it after a run-away;
means over seeds, the least and the largest in brackets.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import tyro
from rich.console import Console

from mcmj.experiments.base import table_of
from mcmj.learning.environments.environment import Environment, all_tasks, load
from mcmj.utils.validation import Array

Policy = Callable[[Environment, dict[str, Any], np.random.Generator], Array]


def zero(env: Environment, observation: dict[str, Any], rng: np.random.Generator) -> Array:
    """Do nothing."""
    return np.zeros(env.action_spec().shape)


def random(env: Environment, observation: dict[str, Any], rng: np.random.Generator) -> Array:
    """Anything within the bounds."""
    spec = env.action_spec()
    drawn: Array = rng.uniform(spec.minimum, spec.maximum)
    return drawn


def readout(env: Environment, observation: dict[str, Any], rng: np.random.Generator) -> Array:
    """What the trained readout says of the signals, fed back."""
    says = env.physics.reservoir.readout.outputs(observation["signals"])
    return np.concatenate([np.zeros(env.action_spec().shape[0] - len(says)), says])


def score(env: Environment, policy: Policy, seed: int) -> float:
    """Mean reward of one episode."""
    env.task.reseed(seed)
    rng, step, rewards = np.random.default_rng(seed), env.reset(), []
    while not step.last():
        step = env.step(policy(env, step.observation, rng))
        rewards.append(step.reward)
    return float(np.sum(rewards) * env.control_timestep() / env.task.setting.time_limit)


def main(seeds: int = 10) -> None:
    """Print the table.

    Args:
        seeds: episodes of each task and policy.
    """
    policies = (zero, random, readout)
    names = [policy.__name__ for policy in policies]
    table = table_of(f"mean reward, {seeds} seeds", "body", "task", *names, words=2)
    for body, task in all_tasks():
        env = load(body, task)
        found = [[score(env, policy, seed) for seed in range(seeds)] for policy in policies]
        cells = [f"{np.mean(one):.3f} ({min(one):.3f} .. {max(one):.3f})" for one in found]
        table.add_row(body, task, *cells)
    Console(width=110).print(table)


if __name__ == "__main__":
    tyro.cli(main)
