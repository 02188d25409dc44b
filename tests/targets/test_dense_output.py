"""Compiled dense output against SciPy's own, and against the equation at a tight tolerance."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mcmj.targets.dense_output import DenseOutput
from mcmj.targets.input_profiles import Profile
from mcmj.targets.input_systems import QUADRATIC
from mcmj.targets.limit_cycles import quadratic_flow, target


def pendulum(t, x):
    return np.array([x[1], -np.sin(x[0]), np.cos(t)])


def test_it_is_scipy_s_dense_output():
    solution = solve_ivp(
        pendulum, (0.0, 20.0), [1.0, 0.0, 0.0], method="DOP853", rtol=1e-8, dense_output=True
    )
    dense, rng = DenseOutput.of(solution), np.random.default_rng(0)
    inside = np.sort(rng.uniform(0, 20, 1000))
    for times in (inside, inside[::-1], rng.permutation(inside), solution.t, [-0.1, 20.1], []):
        at = np.array(times)
        wanted = solution.sol(at).T if len(at) else np.zeros((0, 3))
        assert np.abs(dense(at) - wanted).max(initial=0.0) < 1e-14
    assert np.array_equal(DenseOutput.from_arrays(dense.arrays)(inside), dense(inside))
    early = inside[inside <= 7.0]
    assert np.array_equal(dense.until(7.0)(early), dense(early))
    assert len(dense.until(7.0).knots) < len(dense.knots)


@pytest.mark.parametrize("name", ["van_der_pol", "quadratic"])
def test_targets_are_those_of_a_tighter_integration(name):
    goal = target(name)
    times = np.linspace(0, goal.period, 500)
    exact = solve_ivp(
        goal.rhs, (0.0, goal.period), goal.sample([0.0])[0], method="DOP853", rtol=2.3e-14,
        atol=1e-15, t_eval=times,
    )  # fmt: skip
    assert np.abs(goal.sample(times) - exact.y.T).max() < 2e-9


def test_a_driven_path_is_that_of_a_tighter_integration():
    path, start = QUADRATIC.follow(Profile.parse("lin 1 4 6")), QUADRATIC.cycle(1.0).sample([0.0])
    times = np.linspace(0, 6, 300)
    exact = solve_ivp(
        lambda t, x: quadratic_flow(x, 1 + t / 2), (0.0, 6.0), start[0], method="DOP853",
        rtol=2.3e-14, atol=1e-15, t_eval=times,
    )  # fmt: skip
    assert np.abs(path(times) - exact.y.T).max() < 2e-9
