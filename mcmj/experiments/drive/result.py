"""Episodes, and what the search for an input signal found."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.drive.config import Config
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Episode:
    """From total rest: times (K,) [s], inputs (K,), outputs (K, n_outputs), rewards (K,)."""

    times: Array
    inputs: Array
    outputs: Array
    rewards: Array

    @property
    def mean_reward(self) -> float:
        """What is searched for."""
        return float(self.rewards.mean())


@dataclass(frozen=True)
class Result:
    """The search.

    Attributes:
        rewards: (rounds, population) mean rewards of all episodes.
        before, after: without input, and with the best one found.
        errors: orbit errors of the last period of the two.
    """

    config: Config
    body: Body
    target: Target
    rewards: Array
    before: Episode
    after: Episode
    errors: tuple[float, float]

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        before, after = self.errors
        return {
            "mean_reward_without_input": self.before.mean_reward,
            "mean_reward_learned": self.after.mean_reward,
            "orbit_error_without_input": before,
            "orbit_error_learned": after,
            "episodes": self.rewards.size + 1,
            "best_by_round": self.rewards.max(axis=1),
            "median_by_round": np.median(self.rewards, axis=1),
        }
