"""Phase diffusion against a closed form, and against phase responses measured kick by kick."""

import numpy as np
import pytest

import mcmj
from mcmj.analysis.loops.loop_map import advance
from mcmj.analysis.stability.basin import on_cycle
from mcmj.analysis.stability.cycle import Cycle
from mcmj.analysis.stability.loop import ClosedLoop
from mcmj.analysis.stability.phase import phase_diffusion
from mcmj.utils.errors import InvalidArgumentError

STIFFNESS, MASS, PUSH, WEIGHT, AMPLITUDE = 4.5, 2.0, 1.5, 0.7, 0.05


@pytest.fixture(scope="module")
def swinging():
    """A mass between two springs in a row, m x'' = -2 k x, and its swing of amplitude A.

    The readout is a sum of both lengths, which x does not change, and a bias that makes it 0:
    the outputs feed back the noise alone.
    """
    body = mcmj.Body(
        positions=[[0, 0], [-1, 0], [1, 0]], springs=[[0, 1], [0, 2]], k1=[STIFFNESS] * 2,
        k3=[0.0] * 2, d1=[1e-12] * 2, d3=[0.0] * 2, fixed=[False, True, True],
        w_fb=[[PUSH], [0.0], [0.0]], masses=[MASS, 1.0, 1.0],
    )  # fmt: skip
    loop = ClosedLoop(body, np.array([[WEIGHT], [WEIGHT], [-2 * WEIGHT]]))
    h, rate = loop.timestep, np.sqrt(2 * STIFFNESS / MASS)
    turn = np.arccos(1 - (rate * h) ** 2 / 2)  # a step of Euler's, exactly
    speed = AMPLITUDE * (1 - np.cos(turn)) / h
    scale = AMPLITUDE / np.sqrt(2) * np.array([1.0, 1.0, rate, rate])
    tangent = np.array([speed, 0.0, -(rate**2) * AMPLITUDE, 0.0])
    state = np.array([AMPLITUDE, 0.0, speed, 0.0])
    return loop, Cycle(state, tangent, 2 * np.pi * h / turn, scale, 0.0)


def exact_jitter(loop, cycle, noise):
    """Every step kicks v by c s h, c = PUSH sqrt(2) WEIGHT / MASS, which turns x + i v / rate.

    The angle's variance grows by (c s h)^2 / (2 A^2 rate^2) a step, in the mean over a swing.
    """
    rate = 2 * np.pi / cycle.period
    kick = PUSH * np.sqrt(2) * WEIGHT / MASS * noise * loop.timestep
    steps = cycle.period / loop.timestep
    return np.sqrt(steps * kick**2 / (2 * AMPLITUDE**2 * rate**2)) / (2 * np.pi)


@pytest.mark.slow
def test_a_swing_between_two_springs_has_the_jitter_of_its_closed_form(swinging):
    """Of 40 measurements, and so has their spread the size of their standard errors."""
    loop, cycle = swinging
    found = [phase_diffusion(loop, cycle, 1e-3, copies=32, rest=0, seed=k) for k in range(40)]
    jitters = np.array([one.jitter for one in found])
    exact = exact_jitter(loop, cycle, 1e-3)
    assert np.sqrt((jitters**2).mean()) == pytest.approx(exact, rel=0.05)
    errors = np.mean([one.jitter_error for one in found])
    assert jitters.std(ddof=1) == pytest.approx(errors, rel=0.25)
    coefficients = np.array([one.coefficient for one in found])
    assert coefficients.mean() == pytest.approx(exact**2 * cycle.period / 2, rel=0.1)


def test_what_cannot_be_measured_is_refused(swinging):
    loop, cycle = swinging
    with pytest.raises(InvalidArgumentError, match="noise"):
        phase_diffusion(loop, cycle, 0.0)
    with pytest.raises(InvalidArgumentError, match="an amplitude that the cycle survives"):
        phase_diffusion(loop, cycle, 1e200, copies=2)
    with pytest.raises(InvalidArgumentError, match="a readout"):
        phase_diffusion(ClosedLoop(loop.body, None), cycle, 1e-3, copies=2)


def phase_responses(loop, cycle, channel, moments=48, size=1e-3, rest=4):
    """Shifts (moments,) per unit pushed by one channel for one step, at moments of the cycle.

    Time shifts of the outputs, after a rest, between a push forward and one back.
    """
    states, steps = on_cycle(loop, cycle, moments), round(cycle.period / loop.timestep)
    push = np.zeros((2 * moments, 1, loop.body.n_outputs))
    push[:moments, 0, channel], push[moments:, 0, channel] = size, -size
    after = loop.run(np.tile(states, (2, 1)), offset=push).states
    outputs = loop.run(advance(loop, after, rest * steps), steps).outputs
    forward, back = np.split(outputs, 2)
    rates = np.gradient(forward, loop.timestep, axis=1)
    shifts = ((forward - back) * rates).sum(axis=(1, 2)) / (rates**2).sum(axis=(1, 2))
    return shifts / (2 * size)


@pytest.mark.slow
def test_a_taught_body_has_the_jitter_of_its_phase_responses(taught_loop):
    """Linear response: the variance of a period is that of all its steps' shifts together."""
    loop, cycle, _ = taught_loop
    responses = np.stack([phase_responses(loop, cycle, c) for c in (0, 1)], axis=1)
    through = responses @ loop.w_out[: loop.body.n_springs].T  # per unit of noise on each length
    variance = cycle.period / loop.timestep * (through**2).sum(axis=1).mean()
    expected = np.sqrt(variance) / cycle.period
    found = phase_diffusion(loop, cycle, 1e-4, copies=512, seed=1)
    assert found.jitter_error < 0.035 * found.jitter
    assert abs(found.jitter / 1e-4 - expected) < 3 * found.jitter_error / 1e-4
    strong, weak = (phase_diffusion(loop, cycle, s, copies=32).shifts for s in (1e-4, 1e-5))
    spread = strong.std()
    np.testing.assert_allclose(
        10 * (weak - weak.mean()), strong - strong.mean(), atol=0.01 * spread
    )
