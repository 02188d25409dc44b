"""A standard algorithm learns to drive a body by its input channel, as a dm_control task.

A readout taught by teacher forcing alone keeps its rhythm, but need not find it from total
rest. The cross-entropy method (Rubinstein and Kroese, 2004) searches for an input signal over
the first seconds that brings the body onto the orbit; it sees only the episodes' rewards.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mcmj.core.random_body import random_body
from mcmj.experiments.drive.config import Config
from mcmj.experiments.drive.result import Episode, Result
from mcmj.learning.environments.setting import Setting
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import teach
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.named import named_target
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

if TYPE_CHECKING:
    from mcmj.learning.environments.environment import Environment


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
        actions="inputs", input_limit=config.input_limit, start="rest", kick=0.0, gate=1.0,
        control_timestep=config.control_timestep, time_limit=config.time_limit,
    )  # fmt: skip
    environment = make(Simulation(body, w_out=fit.w_out), wanted, setting)

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
    found: Array = np.interp(times, at, [*knots, 0.0])
    return found


def _play(environment: "Environment", signal: Array) -> Episode:
    """One episode; the rewards of what is left of it after a run-away are 0."""
    environment.reset()
    n_outputs = environment.physics.reservoir.n_outputs
    outputs, rewards = np.zeros((len(signal), n_outputs)), np.zeros(len(signal))
    for k, value in enumerate(signal):
        step = environment.step(np.array([value]))
        outputs[k], rewards[k] = step.observation["outputs"], step.reward
        if step.last():
            break
    times = environment.control_timestep() * (1 + np.arange(len(signal)))
    return Episode(times, signal, outputs, rewards)
