"""The command: success_rate, which is limit_cycle with other defaults."""

from dataclasses import dataclass, replace

from mcmj.experiments.limit_cycle import config as limit_cycle
from mcmj.experiments.limit_cycle.command import EXPERIMENT as LIMIT_CYCLE


@dataclass(frozen=True)
class Config(limit_cycle.Config):
    """What to run."""

    __doc__ = limit_cycle.Config.__doc__

    seeds: int = 50
    free_run: float = 60.0
    windows: float = 0.0
    measure_cost: bool = False


EXPERIMENT = replace(LIMIT_CYCLE, name="success_rate", config=Config)
