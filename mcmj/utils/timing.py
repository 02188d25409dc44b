"""Timing on a noisy machine: work measured in turns, medians, ratios instead of seconds."""

import time
from collections.abc import Callable, Mapping

import numpy as np

from mcmj.utils.validation import require_count

Work = Callable[[], object]


def interleaved_seconds(
    works: Mapping[str, Work], repeats: int = 7, clock: Callable[[], float] = time.perf_counter
) -> dict[str, list[float]]:
    """Seconds of each work, `repeats` times, in turns after one unmeasured round.

    What disturbs the machine for a while disturbs all of them alike. Works of different lengths on
    one thread are better compared by `time.process_time`: others interrupt long ones more often.
    """
    require_count("repeats", repeats, 1)
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()
    for _ in range(repeats):
        for name, work in works.items():
            start = clock()
            work()
            seconds[name].append(clock() - start)
    return seconds


def median_ratio(seconds: Mapping[str, list[float]], name: str, base: str) -> float:
    """Median over the rounds of one work's time over another's in the same round."""
    return float(np.median(np.array(seconds[name]) / np.array(seconds[base])))
