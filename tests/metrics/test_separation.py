"""Areas under ROC curves against their definition; nothing can be told from noise."""

import numpy as np
import pytest

from mcmj.metrics.separation import auc, held_out_auc
from mcmj.utils.errors import InvalidArgumentError

RNG = np.random.default_rng(0)


def pairs(values, good):
    """The definition: the share of pairs of a success and a failure in the right order."""
    won = [1.0 if a > b else 0.5 if a == b else 0.0 for a in values[good] for b in values[~good]]
    return np.mean(won)


def test_the_area_is_the_share_of_pairs_in_order():
    for size in (5, 40):
        values = RNG.integers(0, 8, size).astype(float)  # with ties
        good = np.arange(size) % 3 == 0
        assert auc(values, good) == pytest.approx(pairs(values, good), abs=1e-14)
        assert auc(-values, good) == pytest.approx(1.0 - pairs(values, good), abs=1e-14)


def test_without_both_kinds_there_is_no_area():
    with pytest.raises(InvalidArgumentError, match="successes and failures"):
        auc(np.arange(3.0), np.ones(3, bool))
    assert np.isnan(held_out_auc(np.arange(20.0)[:, None], np.arange(20) == 3))


def test_held_out_areas_are_those_of_known_distributions():
    # two normal distributions a distance d apart: P(X > Y) = Phi(d / sqrt 2); Phi(1) = 0.8413
    good = RNG.random(4000) < 0.4
    x = RNG.standard_normal(4000) + np.sqrt(2.0) * good
    assert held_out_auc(x[:, None], good) == pytest.approx(0.8413, abs=0.015)
    assert held_out_auc(-x[:, None], good) == pytest.approx(0.8413, abs=0.015)
    both = np.column_stack([x, RNG.standard_normal(4000) + np.sqrt(2.0) * good])
    assert held_out_auc(both, good) == pytest.approx(0.9214, abs=0.015)  # Phi(sqrt 2)


def test_noise_tells_nothing():
    good = RNG.random(2000) < 0.5
    assert held_out_auc(RNG.standard_normal((2000, 3)), good) == pytest.approx(0.5, abs=0.05)
