"""CMA-ES in a box: candidates drawn from a normal distribution that follows the best of them.

Hansen's covariance matrix adaptation (N. Hansen, The CMA evolution strategy: a tutorial,
arXiv:1604.00772), by the package `cmaes`. Only the order of the scores counts: a body that blew up
has an infinite one.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.extras import extra
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_number


class Evolution:
    """Proposals around 0, inside [-bound, bound]^size; small scores are good.

    Args:
        size: number of parameters.
        seed: of the proposals.
        spread: standard deviation of the first ones.
        bound: of every parameter.

    Raises:
        MissingExtraError: cmaes is not installed.
        InvalidArgumentError: a number out of bounds.
    """

    def __init__(self, size: int, seed: int, *, spread: float, bound: float) -> None:
        require_count("size", size, 2)
        require_number("spread", spread, 0.0, open_low=True)
        require_number("bound", bound, 0.0, open_low=True)
        with extra("design", "designing bodies needs cmaes"):
            from cmaes import CMA
        self._strategy: Any = CMA(
            mean=np.zeros(size),
            sigma=spread,
            bounds=np.tile([-bound, bound], (size, 1)),
            seed=int(stream(seed, "body_design").integers(2**32)),
        )

    @property
    def population(self) -> int:
        """Candidates in a generation."""
        return int(self._strategy.population_size)

    def ask(self) -> Array:
        """A generation (population, size)."""
        return np.array([self._strategy.ask() for _ in range(self.population)])

    def tell(self, candidates: Array, scores: Sequence[float]) -> None:
        """Scores of a whole generation; the next one follows its better half.

        Raises:
            InvalidArgumentError: NaN, or not one score a candidate.
        """
        if len(scores) != len(candidates) or np.isnan(scores).any():
            raise InvalidArgumentError("scores", f"{len(candidates)} numbers, no NaN", scores)
        ranks = np.argsort(np.argsort(scores, kind="stable"))
        self._strategy.tell([(x, float(k)) for x, k in zip(candidates, ranks, strict=True)])
