"""The triangular factor, folded block by block, against one QR decomposition of all rows."""

import numpy as np
import pytest

from mcmj.learning import fold as module
from mcmj.learning.fold import fold


def oscillations(rows, columns, decades):
    """Columns that are nearly dependent, as neighbouring springs are: sums of a few sines."""
    rng, times = np.random.default_rng(1), np.arange(rows)[:, None] * 1e-3
    sines = np.sin(times * rng.uniform(0.3, 9, columns) + rng.uniform(0, 6, columns))
    return 30 + sines @ rng.normal(size=(columns, columns)) * np.logspace(0, -decades, columns)


def folded(matrix, blocks):
    factor = np.zeros((0, matrix.shape[1]))
    for block in np.array_split(matrix, blocks):
        factor = fold(factor, block)
    return factor


def by_sign(factor):
    return factor * np.where(factor.diagonal() < 0, -1.0, 1.0)[:, None]


@pytest.mark.parametrize("decades", [0, 3, 6])
@pytest.mark.parametrize("blocks", [1, 3])
def test_it_is_the_factor_of_all_rows(decades, blocks, monkeypatch):
    matrix = oscillations(30_000, 20, decades)
    wanted = by_sign(np.linalg.qr(matrix, mode="r"))
    found = by_sign(folded(matrix, blocks))
    assert np.array_equal(found, np.triu(found))
    # column by column, as backward stable methods are
    assert (np.abs(found - wanted).max(axis=0) < 1e-12 * np.linalg.norm(wanted, axis=0)).all()
    monkeypatch.setattr(module, "_by_gram", lambda *arguments: None)
    reflected = np.linalg.svd(folded(matrix, blocks))[1]
    values, exact = np.linalg.svd(found)[1], np.linalg.svd(wanted)[1]
    conditioned = 1e-15 * exact[0] / exact
    assert (np.abs(values / exact - 1) < 20 * conditioned).all()
    assert (np.abs(reflected / exact - 1) < 20 * conditioned).all()  # no better


def test_rows_that_the_sample_misses_are_reflected():
    """One row in 8192 has what no other has."""
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(8192, 4)) * [1.0, 1.0, 1.0, 1e-9]
    matrix[4001, 3] = 1e3
    assert module._by_gram(*sampled(matrix)) is None
    wanted = by_sign(np.linalg.qr(matrix, mode="r"))
    upper = np.triu_indices(4)
    assert np.abs(by_sign(folded(matrix, 1))[upper] / wanted[upper] - 1).max() < 1e-10


@pytest.mark.parametrize("column", [0.0, 5.0])
def test_columns_without_rank(column):
    """A column of zeros, and one like another: the factor is as singular as the data."""
    matrix = oscillations(9000, 6, 0)
    matrix[:, 1], matrix[:, 4] = 5.0, column
    values = np.linalg.svd(folded(matrix, 2))[1]
    exact = np.linalg.svd(matrix, compute_uv=False)
    assert np.abs(values - exact).max() < 1e-12 * exact[0]


def sampled(matrix):
    nothing = np.zeros((0, matrix.shape[1]))
    return np.asfortranarray(module._by_reflections(nothing, matrix[::8])), nothing, matrix
