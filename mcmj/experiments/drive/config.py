"""What the search for an input signal runs: its Config."""

from dataclasses import dataclass

from mcmj.core.random_body import MOST_NODES
from mcmj.targets.named import named_target
from mcmj.utils.validation import (
    require_count,
    require_duration,
    require_number,
    require_seed,
)


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


def total_episodes(config: Config) -> int:
    """For a progress bar."""
    return config.population * config.rounds + 2
