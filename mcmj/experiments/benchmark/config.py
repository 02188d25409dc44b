"""What the benchmark measures: its Config, and the readout that closes its loops."""

from dataclasses import dataclass

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import MOST_NODES
from mcmj.utils.validation import MOST_STEPS, Array, require_count, require_name, require_seed

TRIALS = ("limit_cycle", "perturb", "swing_up", "gaits", "input_driven")
READOUT_SIZE = 1e-4  # small weights: what they are costs nothing, and the loop stays quiet


@dataclass(frozen=True)
class Config:
    """What to measure.

    Attributes:
        nodes: size of the body of most measurements.
        sizes: numbers of nodes of the growth curves.
        steps: control steps of each measured piece of work.
        repeats: rounds, of which the median counts.
        seed: of the bodies.
        memory_steps: length of the run whose peak memory is measured; 0: leave it out.
        trials: experiments of which a whole trial is measured.
    """

    nodes: int = 30
    sizes: tuple[int, ...] = (10, 30, 100, 300, 1000, 3000)
    steps: int = 2000
    repeats: int = 9
    seed: int = 0
    memory_steps: int = 1_000_000
    trials: tuple[str, ...] = TRIALS

    def __post_init__(self) -> None:
        require_count("steps", self.steps, 10)
        require_count("repeats", self.repeats, 1)
        require_seed("seed", self.seed)
        require_count("memory_steps", self.memory_steps, 0, MOST_STEPS)
        require_name("trial", TRIALS, *self.trials)
        require_count("number of sizes", len(self.sizes), 1)
        for name, sizes in (("nodes", (self.nodes,)), ("sizes", self.sizes)):
            for size in sizes:
                require_count(name, size, 3, MOST_NODES)


def small_readout(body: Body) -> Array:
    """A readout (L, n_outputs) that closes the loop and does next to nothing."""
    return np.full((body.n_springs, body.n_outputs), READOUT_SIZE)
