"""Targets: known periods, orbits that satisfy their equations, errors that say why."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mcmj.targets.limit_cycles import (
    TARGETS,
    Target,
    from_array,
    limit_cycle,
    quadratic,
    target,
    van_der_pol,
)
from mcmj.utils.errors import InvalidArgumentError, McmjError, UnknownNameError

VAN_DER_POL_PERIOD = 6.6632868593231301269969  # mu = 1


def van_der_pol_rhs(t, x):
    return np.array([x[1], -x[0] + (1 - x[0] ** 2) * x[1]])


def quadratic_rhs(t, x, eps=7.0):
    r2 = x[0] ** 2 + x[1] ** 2
    return np.array([x[0] + x[1] - eps * x[0] * r2, -2 * x[0] + x[1] - x[1] * r2])


def hopf(t, x):
    """r' = r (1 - r^2), angle' = 1 / 2: the unit circle, period 4 pi."""
    r2 = x @ x
    return np.array([x[0] * (1 - r2) - x[1] / 2, x[1] * (1 - r2) + x[0] / 2])


@pytest.fixture(scope="module", params=TARGETS)
def any_target(request):
    return target(request.param)


def test_van_der_pol_period():
    assert van_der_pol().period == pytest.approx(VAN_DER_POL_PERIOD, rel=2e-12)


@pytest.mark.parametrize(
    ("name", "rhs"), [("van_der_pol", van_der_pol_rhs), ("quadratic", quadratic_rhs)]
)
def test_orbit_satisfies_its_equation(name, rhs):
    """Central differences of fourth order along the curve."""
    goal, h = target(name), 1e-3
    t = np.linspace(2 * h, goal.period - 2 * h, 997)
    slope = (8 * (goal.sample(t + h) - goal.sample(t - h))
             - (goal.sample(t + 2 * h) - goal.sample(t - 2 * h))) / (12 * h)  # fmt: skip
    wanted = np.array([rhs(0.0, x) for x in goal.sample(t)])
    assert np.abs(slope - wanted).max() < 1e-7 * np.abs(wanted).max()


@pytest.mark.parametrize(
    ("name", "rhs"), [("van_der_pol", van_der_pol_rhs), ("quadratic", quadratic_rhs)]
)
def test_another_integrator_returns_to_the_start_after_a_period(name, rhs):
    goal = target(name)
    start = goal.sample([0.0])[0]
    back = solve_ivp(rhs, (0, goal.period), start, method="Radau", rtol=1e-9, atol=1e-11).y[:, -1]
    assert np.abs(back - start).max() < 1e-7


def test_quadratic_takes_its_parameter():
    goal = quadratic(3.0)
    start = goal.sample([0.0])[0]
    back = solve_ivp(quadratic_rhs, (0, goal.period), start, args=(3.0,), rtol=1e-10, atol=1e-12)
    assert np.abs(back.y[:, -1] - start).max() < 1e-8
    assert goal.period != pytest.approx(quadratic().period, rel=1e-3)


def test_lissajous_has_frequencies_two_to_three():
    goal = target("lissajous")
    assert goal.period == pytest.approx(4 * np.pi, rel=1e-15)
    spectrum = np.abs(np.fft.rfft(goal.orbit(1024), axis=0)) / 512
    assert np.flatnonzero(spectrum[:, 0] > 1e-9).tolist() == [2]
    assert np.flatnonzero(spectrum[:, 1] > 1e-9).tolist() == [3]
    assert spectrum[[2, 3], [0, 1]] == pytest.approx([1.0, 1.0], rel=1e-12)


def test_orbit_is_closed_and_periodic(any_target):
    size = np.ptp(any_target.orbit(256), axis=0).max()
    t = np.linspace(0, any_target.period, 400)
    for cycles in (1, 7, -3):
        shifted = any_target.sample(t + cycles * any_target.period)
        assert np.abs(shifted - any_target.sample(t)).max() < 1e-8 * size


def test_no_shorter_period(any_target):
    """The first return is the period, not a multiple: no earlier sample is near the start."""
    orbit = any_target.orbit(1000)
    speed = np.linalg.norm(orbit[1] - orbit[0])
    away = np.linalg.norm(orbit[20:-20] - orbit[0], axis=1)
    velocity = np.linalg.norm((orbit[21:-19] - orbit[20:-20]) - (orbit[1] - orbit[0]), axis=1)
    assert (away + velocity).min() > speed


def test_orbit_and_sample_agree(any_target):
    t = np.arange(10) * any_target.period / 10
    assert np.abs(any_target.orbit(10) - any_target.sample(t)).max() < 1e-14
    assert any_target.n_outputs == 2


def test_a_user_s_own_equation():
    goal = limit_cycle("hopf", hopf, [0.3, -0.2])
    assert goal.period == pytest.approx(4 * np.pi, rel=1e-10)
    assert np.linalg.norm(goal.orbit(500), axis=1) == pytest.approx(np.ones(500), abs=1e-9)
    turned = goal.sample([0.0, np.pi])  # a quarter turn
    assert turned[0] @ turned[1] == pytest.approx(0.0, abs=1e-9)
    assert turned[0, 0] * turned[1, 1] - turned[0, 1] * turned[1, 0] == pytest.approx(1.0, abs=1e-9)


def test_a_slow_cycle_needs_a_longer_search():
    def slow(t, x):
        return hopf(t, x) / 20

    with pytest.raises(McmjError, match=r"hopf: no return to .* within 100 s"):
        limit_cycle("hopf", slow, [1.0, 0.0])
    goal = limit_cycle("hopf", slow, [1.0, 0.0], longest_period=400.0)
    assert goal.period == pytest.approx(80 * np.pi, rel=1e-9)


def test_three_dimensions():
    def rhs(t, x):
        return np.array([*hopf(t, x[:2]), x[0] - x[2]])

    goal = limit_cycle("driven", rhs, [1.0, 0.0, 0.0])
    assert goal.n_outputs == 3
    assert goal.period == pytest.approx(4 * np.pi, rel=1e-9)


@pytest.mark.parametrize(
    ("rhs", "text"),
    [
        (lambda t, x: -x, "rests: no limit cycle after 100 s"),
        (lambda t, x: 0 * x, "rests: no limit cycle after 100 s"),
        (lambda t, x: np.array([x[1] - 0.01 * x[0], -x[0] - 0.01 * x[1]]), "no return"),
        (lambda t, x: x, "no return"),
        (lambda t, x: x**3, "cannot be integrated"),
    ],
)
def test_systems_without_a_cycle_say_so(rhs, text):
    with pytest.raises(McmjError, match=text):
        limit_cycle("rests", rhs, [1.0, 0.5])


def test_from_array_of_a_circle():
    angles = 2 * np.pi * np.arange(200) / 200
    goal = from_array("circle", np.column_stack([np.cos(angles), np.sin(angles)]), 0.01)
    assert goal.period == pytest.approx(2.0, rel=1e-14)
    t = np.linspace(-3, 5, 777)
    exact = np.column_stack([np.cos(np.pi * t), np.sin(np.pi * t)])
    assert np.abs(goal.sample(t) - exact).max() < 3e-8  # cubic spline: (pi / 100)^4 / 384


def test_from_array_goes_through_the_samples():
    values = np.random.default_rng(0).normal(size=(9, 3))
    goal = from_array("random", values, 0.1)
    assert goal.n_outputs == 3
    assert np.abs(goal.sample(0.1 * np.arange(9)) - values).max() < 1e-13


@pytest.mark.parametrize(
    ("values", "timestep", "text"),
    [
        (np.ones(10), 0.1, "values: expected shape"),
        (np.full((10, 2), np.nan), 0.1, "values: expected finite"),
        (np.ones((3, 2)), 0.1, "samples: expected an integer >= 4"),
        (np.ones((10, 2)), 0.0, "timestep: "),
    ],
)
def test_bad_arrays(values, timestep, text):
    with pytest.raises(InvalidArgumentError, match=text):
        from_array("mine", values, timestep)


def test_an_open_curve_is_refused():
    with pytest.raises(InvalidArgumentError, match=r"curve: expected a closed curve of period 2"):
        Target("open", 2.0, lambda t: np.column_stack([t, t]))
    with pytest.raises(InvalidArgumentError, match="period: "):
        Target("none", 0.0, lambda t: np.column_stack([t, t]))


def test_faster_is_the_same_orbit_in_less_time(any_target):
    fast, times = any_target.faster(3.7), np.linspace(0.0, 20.0, 501)
    assert fast.period == any_target.period / 3.7
    assert np.abs(fast.sample(times) - any_target.sample(3.7 * times)).max() < 1e-11
    if fast.rhs is not None:  # it solves the equation that it names
        solution = solve_ivp(
            fast.rhs, (0.0, fast.period), fast.sample([0.0])[0], rtol=1e-9, atol=1e-11
        )
        assert np.abs(solution.y[:, -1] - fast.sample([0.0])[0]).max() < 1e-7
    with pytest.raises(InvalidArgumentError, match="pace"):
        any_target.faster(0.0)


def test_unknown_name_lists_the_targets():
    with pytest.raises(UnknownNameError) as caught:
        target("circle")
    assert caught.value.choices == ["lissajous", "quadratic", "van_der_pol"]


def test_eps_must_be_positive():
    with pytest.raises(InvalidArgumentError, match="eps: "):
        quadratic(0.0)
