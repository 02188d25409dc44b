"""NARMA-10 and the memory capacity against another program's, reservoirpy."""

import numpy as np
import pytest

pytest.importorskip("reservoirpy", reason="reservoirpy is not installed")

from reservoirpy.datasets import narma
from reservoirpy.nodes import Reservoir, Ridge
from reservoirpy.observables import memory_capacity as their_capacity

from mcmj.metrics.capacity import memory_capacity
from mcmj.targets.filter_tasks import narma10


def test_narma_10_step_by_step():
    """Its sum of order n is y_(k-1) + .. + y_(k-n), its input u_(k-n): n = 9, and y_k^2 in a1.

    Its docstring and Atiya and Parlos have y_k + .. + y_(k-n+1) and u_(k-n+1), as we do.
    """
    task = narma10(np.random.default_rng(0), 300)
    u, y = (task.inputs + 1) / 4, np.vstack([[[0.0]], task.targets])  # y_k at [k]
    for k in range(9, 300):
        past, a1 = y[k - 9 : k + 1], 0.3 + 0.05 * y[k, 0]
        shown = np.vstack([u[k - 9 : k + 1], [[0.0]]])
        _, found = narma(2, order=9, a1=a1, a2=0.05, b=1.5, c=0.1, x0=past, u=shown)
        assert found[-1, 0] == pytest.approx(y[k + 1, 0], abs=1e-14), k
    assert y.std() > 0.05


def test_memory_capacity_by_delay():
    """Theirs is a squared correlation on held-out data, ours a fit on all: alike to 1 / sqrt(K)."""
    u = np.random.default_rng(1).uniform(-0.8, 0.8, (6000, 1))
    reservoir = Reservoir(20, sr=0.9, input_scaling=0.1, seed=2)
    theirs = their_capacity(reservoir >> Ridge(ridge=1e-12), 25, as_list=True, series=u)
    states = Reservoir(20, sr=0.9, input_scaling=0.1, seed=2).run(u)
    ours = memory_capacity(states[100:], u[100:, 0], 25).by_delay(1)[1:]
    assert np.abs(ours - theirs).max() < 0.04
    assert ours.sum() == pytest.approx(theirs.sum(), abs=0.2)
    assert 5.0 < ours.sum() < 20.0
    assert ours[0] > 0.99
    assert ours[-1] < 0.3
