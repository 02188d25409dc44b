"""The optimiser as it is wired: small is good, the order alone counts, no global randomness."""

import numpy as np
import pytest

from mcmj.search.evolution import Evolution
from mcmj.utils.errors import InvalidArgumentError

GOAL = np.array([1.0, -0.5, 0.3, 0.0])


def best_of(score, generations=60, seed=0):
    evolution = Evolution(4, seed, spread=0.5, bound=2.0)
    best = (np.inf, None)
    for _ in range(generations):
        candidates = evolution.ask()
        assert (np.abs(candidates) <= 2.0).all()
        scores = [score(x) for x in candidates]
        best = min(best, (min(scores), candidates[int(np.argmin(scores))].tolist()))
        evolution.tell(candidates, scores)
    return np.array(best[1])


def distance(x):
    return float(np.sum((x - GOAL) ** 2))


def test_it_comes_to_the_smallest_score():
    assert np.abs(best_of(distance) - GOAL).max() < 1e-3


def test_the_order_of_the_scores_alone_counts():
    found = best_of(distance)
    assert (best_of(lambda x: 1e6 * distance(x) - 1e9) == found).all()
    assert (best_of(lambda x: distance(x) ** 0.1) == found).all()


def test_infinite_scores_come_last():
    def walled(x):
        return np.inf if x[0] > 0.2 else distance(x)

    assert best_of(walled)[0] == pytest.approx(0.2, abs=1e-2)


def test_a_seed_gives_the_same_bits_whatever_numpys_own_generator_does():
    np.random.seed(1)  # noqa: NPY002  the global one is what must not matter
    one = best_of(distance, 5, seed=3)
    np.random.seed(2)  # noqa: NPY002
    assert (best_of(distance, 5, seed=3) == one).all()
    assert (best_of(distance, 5, seed=4) != one).any()


def test_what_is_no_score_is_refused():
    evolution = Evolution(4, 0, spread=0.5, bound=2.0)
    candidates = evolution.ask()
    for scores in ([0.0], [np.nan] * len(candidates)):
        with pytest.raises(InvalidArgumentError, match="no NaN"):
            evolution.tell(candidates, scores)
