"""Ridge and teacher noise chosen by what the closed loop does, not by the training error.

The training error always prefers no ridge and no noise, with which a free run drifts off its
orbit; what counts is the orbit error of the free run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mcmj.learning.held_out import closed_loop_errors, held_out_starts
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import Course, lessons_of
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.validation import Array, require_count

NOISES = (0.02, 0.05, 0.1, 0.2, 0.4)
RIDGES_PER_ROW = (0.0, 1e-10, 1e-8, 1e-6, 1e-4)
FREE_RUN = 40.0  # s
WINDOW = 20.0  # s: its last part, which counts


@dataclass(frozen=True)
class Selection:
    """The choice, and all that was tried.

    Attributes:
        teaching: the one given, with the ridge and noise chosen.
        w_out: the readout it taught.
        noises, ridges_per_row: tried.
        errors: (noises, ridges) orbit error of the free run, the worst over the starts;
            infinite where one blew up.
        train_nrmse: (noises, ridges) training errors, for comparison.
    """

    teaching: Teaching
    w_out: Array
    noises: tuple[float, ...]
    ridges_per_row: tuple[float, ...]
    errors: Array
    train_nrmse: Array


def select_teaching(
    simulation: Reservoir,
    target: Target,
    teaching: Teaching,
    seed: int,
    *,
    noises: Sequence[float] = NOISES,
    ridges_per_row: Sequence[float] = RIDGES_PER_ROW,
    starts: int = 4,
) -> Selection:
    """Choose ridge and teacher noise by the orbit error of free runs from held-out starts.

    Every noise is taught once; its regression serves all ridges. All candidates run from the
    same starts (learning.held_out), forced with the noise of `teaching`. Of equal errors the first.

    Args:
        simulation: the body; afterwards it has the chosen readout and stands at a start.
        teaching: everything but noise and ridge_per_row.
        seed: of the noise streams.
        noises: standard deviations of the teacher noise (units of the output).
        ridges_per_row: as Teaching's.
        starts: number of held-out starts.

    Raises:
        DivergenceError: the body blew up under the teacher, or with every candidate.
        InvalidArgumentError: an argument out of bounds.
    """
    require_count("noises", len(noises), 1)
    require_count("ridges_per_row", len(ridges_per_row), 1)
    begin = held_out_starts(simulation, target, teaching, seed, starts)
    shape = (len(noises), len(ridges_per_row))
    errors, nrmse = np.full(shape, np.inf), np.full(shape, np.inf)
    readouts: dict[tuple[int, int], Array] = {}
    for i, noise in enumerate(noises):
        simulation.reset()
        course = Course(simulation, replace(teaching, noise=noise), seed)
        course.attend_all(lessons_of(target, teaching))
        for j, ridge in enumerate(ridges_per_row):
            fit = course.regression.solve(ridge * course.regression.weight)
            runs = closed_loop_errors(
                simulation, fit.w_out, begin, target, free_run=FREE_RUN, window=WINDOW
            )
            errors[i, j], nrmse[i, j] = runs.max(), fit.train_nrmse
            readouts[i, j] = fit.w_out
    i, j = (int(k) for k in np.unravel_index(errors.argmin(), shape))
    if not np.isfinite(errors[i, j]):
        raise DivergenceError("the free run blew up with every ridge and noise", 0.0, 0)
    simulation.restore(begin[0])
    simulation.set_readout(readouts[i, j])
    chosen = replace(teaching, noise=noises[i], ridge_per_row=ridges_per_row[j])
    return Selection(chosen, readouts[i, j], tuple(noises), tuple(ridges_per_row), errors, nrmse)
