"""The triangular factor of a QR decomposition, updated by more rows.

Let S be the factor of [R; a sample of the rows B], by Householder's reflections. Then the entries
of C = [R; B] S^-1 are near 1, its Gram matrix is well conditioned, and

    L L^T = C^T C,    R <- L^T S

is as accurate as reflections of all rows and takes half the time (Cholesky QR behind a randomised
preconditioner: Balabanov 2022). Where C is large, the sample missed something: then reflections
do it all.
"""

import numpy as np
from scipy.linalg.blas import dsyrk, dtrmm, dtrsm
from scipy.linalg.lapack import dgeqrt, dpotrf

from mcmj.utils.validation import Array

SAMPLE = 512  # rows of a sample, or four for every column
REFLECTED = 1024  # rows at a time
PANEL = 2048  # rows of C at a time: with S they stay in the processor's cache
COLUMNS = 16  # of a block of reflections
LARGEST = 1e4  # squared norm of a column of C: rounding errors of R grow with it


def fold(factor: Array, block: Array) -> Array:
    """R of the QR decomposition of [factor; block], up to the signs of its rows.

    Args:
        factor: (k, n) upper triangular, k <= n.
        block: (m, n).

    Returns:
        (min(k + m, n), n).
    """
    every = len(block) // max(SAMPLE, 4 * block.shape[1])
    if every > 1:
        sampled = _by_reflections(factor, block[::every])
        found = _by_gram(np.asfortranarray(sampled), factor, block)
        if found is not None:
            return found
    return _by_reflections(factor, block)


def _by_gram(sampled: Array, factor: Array, block: Array) -> Array | None:
    """L^T S; None if that would not be accurate."""
    if not sampled.diagonal().all():
        return None
    gram = np.zeros(sampled.shape, order="F")
    for rows in (factor, *(block[i : i + PANEL] for i in range(0, len(block), PANEL))):
        if len(rows):
            scaled = dtrsm(1.0, sampled, rows.T, trans_a=1)  # of C^T
            gram = dsyrk(1.0, scaled, beta=1.0, c=gram, overwrite_c=True)
    if not gram.diagonal().max() <= LARGEST:  # NaN is not
        return None
    upper, failed = dpotrf(gram, overwrite_a=True)
    return None if failed else np.ascontiguousarray(dtrmm(1.0, upper, sampled))


def _by_reflections(factor: Array, block: Array) -> Array:
    """Some rows at a time (TSQR: Demmel et al. 2012)."""
    for first in range(0, len(block), REFLECTED):
        rows = np.asfortranarray(np.vstack([factor, block[first : first + REFLECTED]]))
        reflected, _, _ = dgeqrt(min(COLUMNS, *rows.shape), rows, overwrite_a=True)
        factor = np.triu(reflected[: block.shape[1]])
    return factor
