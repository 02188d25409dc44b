"""Wilson's interval against SciPy's."""

import pytest
from scipy.stats import binomtest

from mcmj.metrics.success_rates import success_rate


@pytest.mark.parametrize("total", [1, 3, 50])
def test_the_interval_is_scipy_s(total):
    for count in range(total + 1):
        rate = success_rate([True] * count + [False] * (total - count))
        wanted = binomtest(count, total).proportion_ci(method="wilson")
        assert rate["interval_95"] == pytest.approx([wanted.low, wanted.high], abs=1e-15)
        assert (rate["successes"], rate["of"]) == (count, total)
