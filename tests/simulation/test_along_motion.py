"""Brackets of the largest stable step along a motion, against one mass and MuJoCo."""

import numpy as np
import pytest
from networks import simulation

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.hard_cases.run import bisect
from mcmj.simulation.stepsize.along_motion import LOW, KnownMotion, lasting_limit, step_bracket
from mcmj.utils.errors import DivergenceError, UnknownNameError

EXPLICIT = [name for name, row in INTEGRATORS.items() if not row.implicit]
SPEED, D3 = 0.5, 100.0
RATE = D3 * SPEED**2  # 1/s: of a mass of 1 kg


def one_mass(d1, d3):
    return mcmj.Body(
        [(0, 0), (1, 0)], [(0, 1)], [1e-9], [0.0], [d1], [d3], fixed=np.array([True, False])
    )


def moving_along_x(body, times, places, speeds):
    """The free node's motion as that of the body."""
    shape = (len(times), 2, 2)
    positions, velocities = np.broadcast_to(body.positions, shape).copy(), np.zeros(shape)
    positions[:, 1, 0] += places
    velocities[:, 1, 0] = speeds
    return KnownMotion(times, positions, velocities)


def kicked(body):
    """Exact: v = v0 / sqrt(1 + 2 r t), r = d3 v0^2 / m."""
    times = np.concatenate([[0.0], np.geomspace(1e-4, 100.0, 80)]) / RATE
    root = np.sqrt(1 + 2 * RATE * times)
    return moving_along_x(body, times, SPEED / RATE * (root - 1), SPEED / root)


def bears(body, integrator, step):
    sim = simulation(body, integrator, step)
    sim.set_state(velocities=[(0, 0), (SPEED, 0)])
    try:
        with np.errstate(over="ignore"):
            sim.rollout(100, record=())
    except DivergenceError:
        return False
    return bool(np.abs(sim.state.velocities).max() < 10 * SPEED)


@pytest.mark.parametrize(
    ("integrator", "blow_up"), [("Euler", 2.0), ("RK4", 2.387), ("leapfrog", 2.163)]
)
def test_a_kick_on_a_cubic_damper(integrator, blow_up):
    body = one_mass(1e-9, D3)
    measured = bisect(lambda h: bears(body, integrator, h), 1 / RATE, 1e-3)
    assert measured * RATE == pytest.approx(blow_up, rel=2e-3)
    low, high = step_bracket(body, integrator, kicked(body))
    assert measured / (low / LOW) == pytest.approx(1.65, abs=0.2)
    assert high == pytest.approx(2 * low)


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_a_linear_damper_has_the_limit_of_the_linearised_body(integrator):
    body = one_mass(RATE, 0.0)
    times = np.linspace(0.0, 10.0, 50) / RATE
    speeds = SPEED * np.exp(-RATE * times)
    motion = moving_along_x(body, times, (SPEED - speeds) / RATE, speeds)
    low, _ = step_bracket(body, integrator, motion)
    wanted = mcmj.simulation.stepsize.limit.stability_limit(body, integrator)
    assert low / LOW == pytest.approx(wanted, rel=0.011)
    assert bears(body, integrator, 0.98 * wanted)


def test_what_lasts_and_what_does_not():
    """T = 1 for a time of 0.3 in a motion of T = 4: a step of 1 bears that for 0.35 of itself."""
    times = np.array([0.0, 5.0, 5.001, 5.299, 5.3, 20.0])
    limits = np.array([4.0, 4.0, 1.0, 1.0, 4.0, 4.0])
    assert lasting_limit(times, limits, 0.35) == pytest.approx(4.0, rel=0.02)
    assert lasting_limit(times, limits, 0.25) == pytest.approx(1.0, rel=0.02)
    assert lasting_limit(times, np.full(6, np.inf), 0.35) == np.inf


def test_an_unknown_integrator_is_named():
    body = one_mass(1.0, 1.0)
    with pytest.raises(UnknownNameError, match="leapfrog"):
        step_bracket(body, "euler", kicked(body))
