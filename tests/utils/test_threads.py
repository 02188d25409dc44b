"""Runs side by side: order, and what an error in one does to the others."""

import time

import pytest

from mcmj.utils.threads import in_threads


def test_results_come_in_the_items_order_and_steps_are_reported():
    seen = []

    def work(item, report):
        time.sleep(0.02 * (3 - item))
        report(item)
        return item**2

    assert in_threads(work, [1, 2, 3], seen.append) == [1, 4, 9]
    assert sorted(seen) == [1, 2, 3]


def test_an_error_stops_the_others_at_their_next_report():
    reports = []

    def work(item, report):
        if item == "bad":
            raise ValueError("bad item")
        for _ in range(1000):
            time.sleep(0.01)
            report(1)
        return item

    start = time.perf_counter()
    with pytest.raises(ValueError, match="bad item"):
        in_threads(work, ["good", "bad", "later"], reports.append)
    assert time.perf_counter() - start < 5.0  # the good one alone would take 10 s
