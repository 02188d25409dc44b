"""Targets with an input against another integrator, their own limit cycles, and exact ones."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mcmj.metrics.orbits import ORBIT_POINTS, orbit_distances, rms_radius
from mcmj.targets.input_profiles import Profile, hold
from mcmj.targets.input_systems import QUADRATIC, DrivenSystem
from mcmj.targets.limit_cycles import Target, quadratic
from mcmj.utils.errors import InvalidArgumentError


def hopf(x, u):
    """r' = r (u - r^2), angle' = 1: circles of radius sqrt(u)."""
    r2 = x @ x
    return np.array([x[0] * (u - r2) - x[1], x[1] * (u - r2) + x[0]])


def circle(u):
    def curve(times):
        return np.sqrt(u) * np.column_stack([np.cos(times), np.sin(times)])

    return Target("circle", 2 * np.pi, curve)


HOPF = DrivenSystem("hopf", hopf, circle)


def test_the_amplitude_equation_has_an_exact_solution():
    """R = r^2 under u = 1 + t: R' = 2 (1 + t) R - 2 R^2, so 1 / R is linear and known."""
    profile = Profile.parse("lin 1 3 2")
    found = HOPF.follow(profile)(np.linspace(0.0, 2.0, 21))
    t = np.linspace(0.0, 2.0, 20_001)
    growth = np.exp(2 * t + t**2)  # 1 / R = (1 + 2 int growth) / growth
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (growth[1:] + growth[:-1]) * np.diff(t))])
    radius = np.sqrt(growth / (1.0 + 2.0 * integral))
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), radius[::1000], rtol=1e-7)
    angle = np.unwrap(np.arctan2(found[:, 1], found[:, 0]))
    np.testing.assert_allclose(angle, t[::1000], atol=1e-8)


def test_another_integrator_follows_the_same_way():
    """With jumps and kinks; the system is smooth between them only."""
    profile = Profile.parse("log 0.1 5 6, hold 1 3, lin 4 0.2 5")
    goal = QUADRATIC.follow(profile)
    state = goal([0.0])[0]
    for start, ramp in zip(profile.starts, profile.ramps, strict=True):
        solution = solve_ivp(
            lambda t, x, u=ramp: QUADRATIC.flow(x, float(u(t))), (0.0, ramp.duration), state,
            method="Radau", rtol=1e-9, atol=1e-11, t_eval=np.linspace(0.0, ramp.duration, 9),
        )  # fmt: skip
        assert np.abs(goal(start + solution.t[:-1]) - solution.y.T[:-1]).max() < 1e-7
        state = solution.y[:, -1]
    assert np.abs(goal([profile.duration])[0] - state).max() < 1e-7


@pytest.mark.parametrize("eps", [0.2, 1.0, 5.0])
def test_a_constant_input_runs_the_limit_cycle(eps):
    goal = quadratic(eps)
    t = np.linspace(0.0, 40.0, 400)
    held = QUADRATIC.follow(Profile([hold(eps, 40.0)]))(t)
    assert np.abs(held - goal.sample(t)).max() < 1e-6
    jumped = QUADRATIC.follow(Profile([hold(2.0, 1.0), hold(eps, 60.0)]))(t + 21.0)
    assert orbit_distances(jumped, goal).max() < 1e-5


def test_equal_damping_is_the_exact_ellipse():
    """At eps = 1 x1' = x1 (1 - r^2) + x2 and x2' = x2 (1 - r^2) - 2 x1: period 2 pi / sqrt(2)."""
    goal = QUADRATIC.cycle(1.0)
    assert goal.period == pytest.approx(np.sqrt(2.0) * np.pi, rel=1e-9)
    orbit = goal.orbit(500)
    ellipse = 2.0 * orbit[:, 0] ** 2 + orbit[:, 1] ** 2
    assert np.ptp(ellipse) < 1.0  # r^2 averages to 1 on it, but is not constant
    assert rms_radius(goal.orbit(ORBIT_POINTS)) == pytest.approx(1.0, rel=1e-8)


def test_point_symmetry():
    """f(-x, u) = -f(x, u): a start turned by pi stays turned by pi."""
    profile = Profile.parse("lin 0.5 3 10")
    t = np.linspace(0.0, 10.0, 50)
    there = QUADRATIC.follow(profile, np.array([0.4, -0.3]))(t)
    back = QUADRATIC.follow(profile, np.array([-0.4, 0.3]))(t)
    assert np.abs(there + back).max() < 1e-12


def test_times_outside_are_refused():
    goal = HOPF.follow(Profile([hold(1.0, 2.0)]))
    with pytest.raises(InvalidArgumentError, match=r"expected times from 0 to 2 s, got 2\.1"):
        goal([1.0, 2.1])
    with pytest.raises(InvalidArgumentError, match="got -1 s"):
        goal([-1.0])
