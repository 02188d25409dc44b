"""Place and pace in one number: motions whose error is known exactly."""

import numpy as np
import pytest

import mcmj
from mcmj.metrics.motion_error import MotionError
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError

STEP = 0.02


def circle():
    """Radius 2 m about (1, 0), once in 2 pi seconds."""
    return Target(
        "circle", 2 * np.pi, lambda t: np.column_stack([1 + 2 * np.cos(t), 2 * np.sin(t)])
    )


def error(target, path, t):
    samples = [np.asarray(path(s), np.float64) for s in (t - STEP, t)]
    return MotionError(target, STEP).of(samples[1], samples[0])


@pytest.mark.parametrize("time", [0.3, 2.0, 5.1])
@pytest.mark.parametrize("pace", [0.0, 0.5, 0.9, 1.0, 1.2, 2.0, -1.0])
def test_on_a_circle_it_is_the_error_of_the_pace(time, pace):
    """e = |p - 1|: 1 where outputs stand still, 2 where they go backwards."""
    path = circle().sample
    found = error(circle(), lambda s: path([time + pace * (s - time)])[0], time)
    assert found == pytest.approx(abs(pace - 1), abs=0.02)  # 0.01 from the turn within a step


@pytest.mark.parametrize("scale", [0.0, 0.8, 1.3])
def test_a_circle_of_another_size_errs_in_place_and_pace(scale):
    """Both are off by |scale - 1|, at the same angular speed."""
    path = circle().sample
    found = error(circle(), lambda s: [1, 0] + scale * (path([s])[0] - [1, 0]), 1.0)
    assert found == pytest.approx(np.sqrt(2) * abs(scale - 1), abs=2e-3)


def test_a_crossing_is_no_error():
    """Where the Lissajous figure crosses itself the direction tells the branches apart."""
    target = mcmj.target("lissajous")
    times = np.linspace(0.0, target.period, 500)
    worst = max(error(target, lambda s: target.sample([s])[0], t) for t in times)
    assert worst < 0.03  # between POINTS of the orbit


def test_what_cannot_be_judged_is_refused():
    with pytest.raises(InvalidArgumentError, match=r"interval: expected at most 0\.785 s"):
        MotionError(circle(), 1.0)
    rest = Target("rest", 1.0, lambda t: np.zeros((len(t), 2)))
    with pytest.raises(InvalidArgumentError, match="target: expected one that moves"):
        MotionError(rest, 0.01)
