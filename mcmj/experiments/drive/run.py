"""A standard algorithm learns to drive a body by its input channel, as a dm_control task.

A readout taught by teacher forcing alone keeps its rhythm, but need not find it from total
rest. The cross-entropy method (Rubinstein and Kroese, 2004) searches for an input signal over
the first seconds that brings the body onto the orbit; it sees only the episodes' rewards.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import MOST_NODES, random_body
from mcmj.learning.environments.setting import Setting
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import teach
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)

if TYPE_CHECKING:
    from mcmj.learning.environments.environment import Environment


@dataclass(frozen=True)
class Config:
    """What to learn.

    Attributes:
        task: van_der_pol, .., a .csv file or package.module:function: taught to the body, then
            to be reached.
        seed: of the random body, its teaching and the search.
        nodes: of the body.
        knots: of the input signal, one number each, linear in between and 0 after the last.
        drive: the signal ends after this time [s].
        input_limit: largest input [units of the channel].
        population, elites, rounds: of the cross-entropy method.
        spread: first standard deviation, as a share of the limit.
        least_spread: is added to the elites' in every round, as a share of the limit.
        control_timestep: between actions [s].
        time_limit: of an episode, from total rest [s].
    """

    task: str = "van_der_pol"
    seed: int = 2
    nodes: int = 25
    knots: int = 10
    drive: float = 8.0
    input_limit: float = 10.0
    population: int = 24
    elites: int = 6
    rounds: int = 8
    spread: float = 0.5
    least_spread: float = 0.05
    control_timestep: float = 0.05
    time_limit: float = 25.0

    def __post_init__(self) -> None:
        named_target(self.task)
        require_count("knots", self.knots, 1)
        require_count("nodes", self.nodes, 3, MOST_NODES)
        require_seed("seed", self.seed)
        require_duration("time_limit", self.time_limit)
        require_count("rounds", self.rounds, 1)
        require_count("elites", self.elites, 2)
        require_count("population", self.population, self.elites)
        require_number("drive", self.drive, 0.0, self.time_limit, open_low=True)
        require_number("control_timestep", self.control_timestep, 1e-3)
        for name in ("input_limit", "spread"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("least_spread", self.least_spread, 0.0)


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


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach the body, then let the cross-entropy method learn to drive it.

    Args:
        on_steps: called with 1 after every episode, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
    """
    from mcmj.learning.environments.environment import make  # dm_control is an extra

    wanted = named_target(config.task)
    body = random_body(config.seed, config.nodes, n_inputs=1, n_outputs=wanted.n_outputs)
    fit = teach(Simulation(body, engine="twin"), wanted, Teaching(), config.seed)
    setting = Setting(
        actions="inputs", input_limit=config.input_limit, kick=0.0,
        control_timestep=config.control_timestep, time_limit=config.time_limit,
    )  # fmt: skip
    environment = make(body, fit.w_out, wanted, setting)

    def play(knots: Array) -> Episode:
        episode = _play(environment, _signal(config, knots))
        on_steps(1)
        return episode

    before = play(np.zeros(config.knots))
    best, rewards = _cross_entropy(config, lambda knots: play(knots).mean_reward)
    after = play(best)
    period = round(wanted.period / config.control_timestep)
    errors = [orbits.orbit_error(episode.outputs[-period:], wanted) for episode in (before, after)]
    return Result(config, body, wanted, rewards, before, after, (errors[0], errors[1]))


def total_episodes(config: Config) -> int:
    """For a progress bar."""
    return config.population * config.rounds + 2


def _cross_entropy(config: Config, score: Callable[[Array], float]) -> tuple[Array, Array]:
    """The best knots (knots,), and the scores of all (rounds, population)."""
    draw = stream(config.seed, "input_search")
    limit = config.input_limit
    mean, spread = np.zeros(config.knots), np.full(config.knots, config.spread * limit)
    scores = np.zeros((config.rounds, config.population))
    best, best_score = mean, -np.inf
    for k in range(config.rounds):
        drawn = mean + spread * draw.standard_normal((config.population, config.knots))
        tried = np.clip(drawn, -limit, limit)
        scores[k] = [score(knots) for knots in tried]
        order = np.argsort(-scores[k], kind="stable")
        if scores[k, order[0]] > best_score:
            best, best_score = tried[order[0]], scores[k, order[0]]
        elites = tried[order[: config.elites]]
        mean = elites.mean(axis=0)
        spread = elites.std(axis=0) + config.least_spread * limit
    return best, scores


def _signal(config: Config, knots: Array) -> Array:
    """The input at every control step: linear between the knots, 0 at the end of the drive."""
    times = np.arange(round(config.time_limit / config.control_timestep)) * config.control_timestep
    at = np.linspace(0.0, config.drive, config.knots + 1)
    return np.interp(times, at, [*knots, 0.0])


def _play(environment: "Environment", signal: Array) -> Episode:
    """One episode; the rewards of what is left of it after a run-away are 0."""
    environment.reset()
    n_outputs = environment.physics.body.n_outputs
    outputs, rewards = np.zeros((len(signal), n_outputs)), np.zeros(len(signal))
    for k, value in enumerate(signal):
        step = environment.step(np.array([value]))
        outputs[k], rewards[k] = step.observation["outputs"], step.reward
        if step.last():
            break
    times = environment.control_timestep() * (1 + np.arange(len(signal)))
    return Episode(times, signal, outputs, rewards)
