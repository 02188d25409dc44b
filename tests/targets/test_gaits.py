"""Gaits: the oscillators against independent integration and symmetry; how legs are measured."""

import numpy as np
import pytest

from mcmj.metrics import gaits, orbits
from mcmj.targets.gaits import GAITS, LEGS, Gait, gait_target
from mcmj.targets.limit_cycles import Target, limit_cycle
from mcmj.utils.errors import InvalidArgumentError, McmjError, UnknownNameError

# lags behind LF, in periods, that each coupling is made for
LAGS = {
    "walk": (0.0, 0.5, 0.75, 0.25),  # touching down in the order LF RH RF LH
    "trot": (0.0, 0.5, 0.5, 0.0),  # diagonal legs together
    "pace": (0.0, 0.5, 0.0, 0.5),  # legs of a side together
    "bound": (0.0, 0.0, 0.5, 0.5),  # fore legs together
}


def oscillators(state, k, stance, swing):
    """The equations as written in the paper; exponents are small in these tests."""
    x, y = state[:4], state[4:]
    omega = stance / (np.exp(-50 * y) + 1) + swing / (np.exp(50 * y) + 1)
    r2 = x**2 + y**2
    coupled = [sum(k[i][j] * y[j] for j in range(4)) for i in range(4)]
    return np.concatenate([5 * (1 - r2) * x - omega * y, 50 * (1 - r2) * y + omega * x + coupled])


def runge_kutta(rhs, state, step, steps):
    """Classical, fourth order; all states (steps, 8)."""
    states = []
    for _ in range(steps):
        states.append(state)
        a = rhs(state)
        b = rhs(state + step / 2 * a)
        c = rhs(state + step / 2 * b)
        state = state + step / 6 * (a + 2 * b + 2 * c + rhs(state + step * c))
    return np.array(states)


@pytest.fixture(scope="module", params=GAITS)
def gait(request):
    return GAITS[request.param]


def test_the_right_hand_side_is_the_paper_s(gait):
    for state in np.random.default_rng(0).uniform(-1.2, 1.2, (20, 8)):
        wanted = oscillators(state, gait.coupling, gait.stance, gait.swing)
        np.testing.assert_allclose(gait.rhs(0.0, state), wanted, rtol=1e-12, atol=1e-12)


def test_the_right_hand_side_does_not_overflow(gait):
    far = np.array([1.0, -1, 1, -1, 1e3, -1e3, 40, -40])  # exp(50 * 40) is no number
    assert np.isfinite(gait.rhs(0.0, far)).all()


def test_another_integrator_from_another_start_finds_the_same_orbit(gait):
    """Classical Runge-Kutta, legs a little off their phases at the start."""
    goal, step = gait_target(gait.name), 0.01
    angles = -2 * np.pi * (np.add(gait.lags, [0.0, 0.004, -0.003, 0.002]))
    start = np.concatenate([np.cos(angles), np.sin(angles)])

    def rhs(state):
        return oscillators(state, gait.coupling, gait.stance, gait.swing)

    found = runge_kutta(rhs, start, step, 6000)[-1000:, :4]
    assert orbits.orbit_error(found, goal) < 0.004
    assert orbits.period(found, step, goal.period) == pytest.approx(goal.period, rel=1e-5)


def test_legs_step_in_the_order_of_the_gait(gait):
    lags = gaits.target_phase_lags(gait_target(gait.name))
    away = np.mod(lags - LAGS[gait.name] + 0.5, 1.0) - 0.5
    assert np.abs(away).max() < 1e-6


def test_every_leg_does_the_same_later(gait):
    """The couplings treat all legs alike: outputs are one signal at four delays."""
    goal = gait_target(gait.name)
    times = np.linspace(0, goal.period, 500)
    first = goal.sample(times)[:, 0]
    for leg, lag in enumerate(LAGS[gait.name]):
        delayed = goal.sample(times + lag * goal.period)[:, leg]
        assert np.abs(delayed - first).max() < 2e-5, LEGS[leg]


def test_gaits_differ_in_frequency_and_duty_factor():
    periods = {name: gait_target(name).period for name in GAITS}
    duties = {name: gaits.target_duty_factors(gait_target(name)).mean() for name in GAITS}
    assert np.diff(sorted(periods.values())).min() > 0.1
    assert max(periods, key=periods.get) == max(duties, key=duties.get) == "walk"
    assert duties["walk"] > 2 / 3  # two or three legs on the ground
    assert min(duties["trot"], duties["pace"]) > 0.5
    assert duties["bound"] < 0.5  # it leaves the ground


@pytest.mark.parametrize(("stance", "swing"), [(1.0, 3.0), (3.0, 1.0)])
def test_uncoupled_legs_turn_with_the_two_frequencies(stance, swing):
    """On the unit circle: half a turn each; smoothing of width 1 / 50 shifts a little."""
    goal = Gait("free", np.zeros((4, 4)), stance, swing, (0, 0.5, 0.2, 0.7)).target()
    assert goal.period == pytest.approx(np.pi / stance + np.pi / swing, rel=0.02)
    wanted = swing / (stance + swing)
    assert gaits.target_duty_factors(goal) == pytest.approx(4 * [wanted], abs=0.01)


def test_a_target_may_observe_a_part_of_its_state():
    def rhs(t, x):
        r2 = x[0] ** 2 + x[1] ** 2
        return np.array([x[0] * (1 - r2) - x[1], x[1] * (1 - r2) + x[0]])

    whole = limit_cycle("circle", rhs, [1.0, 0.0])
    part = limit_cycle("circle", rhs, [1.0, 0.0], observe=lambda states: states[:, 1:] * 2)
    assert (whole.n_outputs, part.n_outputs) == (2, 1)
    assert part.rhs is None
    times = np.linspace(0, 10, 50)
    assert np.array_equal(part.sample(times)[:, 0], 2 * whole.sample(times)[:, 1])


def test_unknown_gaits_and_wrong_numbers_are_refused():
    with pytest.raises(UnknownNameError, match="unknown gait 'waltz'; valid choices: bound, pace"):
        gait_target("waltz")
    trot = GAITS["trot"]
    with pytest.raises(InvalidArgumentError, match=r"coupling: expected shape \(4, 4\)"):
        Gait("mine", trot.coupling[:3], 1.0, 1.0, trot.lags)
    with pytest.raises(InvalidArgumentError, match="swing: expected a number in"):
        Gait("mine", trot.coupling, 1.0, 0.0, trot.lags)
    with pytest.raises(McmjError, match="never: no return"):
        Gait("never", trot.coupling, 0.1, 0.1, trot.lags).target()


# --- how legs are measured: signals of which everything is known ------------------------------

STEP, PERIOD = 1e-3, 1.7
DELAYS = np.array([0.0, 0.37, 0.91, 0.5])


def leg(phase, duty):
    """1 to -1 in the first `duty` of the phase, and back in the rest."""
    phase = np.mod(phase, 1.0)
    return np.where(
        phase < duty, np.cos(np.pi * phase / duty), -np.cos(np.pi * (phase - duty) / (1 - duty))
    )


def steps(times, duty=0.7, period=PERIOD):
    return leg(np.asarray(times)[:, None] / period - DELAYS, duty)


TARGET = Target("steps", PERIOD, steps)


@pytest.mark.parametrize("seconds", [1.8, 7.0, 20.0])
@pytest.mark.parametrize("duty", [0.3, 0.5, 0.7])
def test_lags_and_duty_factors_of_known_steps(seconds, duty):
    outputs = steps(np.arange(0, seconds, STEP), duty)
    lags = gaits.phase_lags(outputs, STEP, PERIOD)
    assert np.abs(np.mod(lags - DELAYS + 0.5, 1) - 0.5).max() < 1e-3
    duties = gaits.duty_factors(outputs, STEP, PERIOD)
    assert duties == pytest.approx(4 * [duty], abs=2e-3)


def test_errors_are_the_largest_difference():
    assert gaits.phase_lag_error(DELAYS, TARGET) < 1e-6
    assert gaits.phase_lag_error(np.add(DELAYS, [0, 0, 0.2, -0.1]), TARGET) == pytest.approx(0.2)
    assert gaits.phase_lag_error(np.add(DELAYS, [0, 0.9, 0, 0]), TARGET) == pytest.approx(0.1)
    assert gaits.phase_lag_error(np.full(4, np.nan), TARGET) == np.inf
    assert gaits.duty_factor_error(np.full(4, 0.7), TARGET) < 1e-3
    assert gaits.duty_factor_error(np.array([0.7, 0.7, 0.6, 0.7]), TARGET) == pytest.approx(
        0.1, abs=1e-3
    )
    assert gaits.duty_factor_error(np.full(4, np.nan), TARGET) == np.inf


def test_a_leg_that_stands_still_has_no_phase():
    outputs = steps(np.arange(0, 5, STEP))
    outputs[:, 2] = 0.3
    lags = gaits.phase_lags(outputs, STEP, PERIOD)
    assert np.isnan(lags).tolist() == [False, False, True, False]
    outputs[:, 0] = 0.3
    assert np.isnan(gaits.phase_lags(outputs, STEP, PERIOD)).all()


def test_less_than_a_period_is_refused():
    with pytest.raises(InvalidArgumentError, match=r"at least a period of 1\.7 s, got 1 s"):
        gaits.phase_lags(steps(np.arange(0, 1, STEP)), STEP, PERIOD)


def test_a_quarter_later_tells_apart_what_lies_on_one_line():
    """Two legs in antiphase draw a line; at rest or at double pace they lie on it too."""

    def antiphase(times, pace=1.0):
        wave = np.sin(2 * np.pi * pace * np.asarray(times) / PERIOD)
        return np.column_stack([wave, -wave])

    goal = Target("antiphase", PERIOD, antiphase)
    circle = gaits.delay_embedding(goal).orbit(100)
    assert np.hypot(circle[:, 0], circle[:, 2]) == pytest.approx(np.ones(100), abs=1e-12)
    times = np.arange(0, 20, STEP)
    assert gaits.switching_time(antiphase(times), STEP, goal) == 0.0
    for wrong in (antiphase(times, 2.0), np.zeros((len(times), 2))):
        assert orbits.recovery_time(wrong, STEP, goal) == 0.0
        assert gaits.switching_time(wrong, STEP, goal) == np.inf
    late = antiphase(times)
    late[times < 3.25 * PERIOD] *= 0.5  # until a peak
    assert gaits.switching_time(late, STEP, goal) == pytest.approx(3.25 * PERIOD, abs=0.03 * PERIOD)
    with pytest.raises(InvalidArgumentError, match=r"outputs: expected more than 0\.425 s"):
        gaits.switching_time(late[:300], STEP, goal)


def test_orbit_error_in_four_dimensions():
    """Pushed along a direction that the orbit does not take: the push over the RMS radius."""
    goal = gait_target("trot")
    outputs = goal.sample(np.arange(0, 3 * goal.period, STEP))
    assert orbits.orbit_error(outputs, goal) < 1e-4
    aside = 0.03 * np.array([1.0, 0.0, 0.0, -1.0]) / np.sqrt(2)  # diagonal legs do the same
    wanted = 0.03 / orbits.rms_radius(goal.orbit(4096))
    assert orbits.orbit_error(outputs + aside, goal) == pytest.approx(wanted, rel=1e-3)
