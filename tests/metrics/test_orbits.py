"""Errors of outputs: exact values on constructed orbits, and what must not matter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mcmj.metrics import orbits
from mcmj.targets.limit_cycles import Target, target
from mcmj.utils.errors import InvalidArgumentError

PERIOD = 2.0


def circle(t, radius=1.0, period=PERIOD):
    angle = 2 * np.pi * np.asarray(t) / period
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


CIRCLE = Target("circle", PERIOD, circle)
VAN_DER_POL = target("van_der_pol")


@settings(max_examples=15)
@given(
    phase=st.floats(0, 10),
    speed=st.floats(0.2, 3.0),
    wanted=st.sampled_from([CIRCLE, VAN_DER_POL, target("quadratic"), target("lissajous")]),
)
def test_the_target_itself_has_no_orbit_error_at_any_phase_and_speed(phase, speed, wanted):
    t = phase + np.linspace(0, 3.1 * wanted.period, 20_000)
    outputs = wanted.sample(t if speed < 1 else speed * t)
    assert (
        orbits.orbit_error(outputs, wanted) < 1e-4
    )  # 1e-6 of chords, 3.5e-5 where Lissajous crosses


@pytest.mark.parametrize("radius", [0.5, 0.99, 1.1, 2.0])
def test_a_scaled_circle_has_its_difference_in_radius(radius):
    outputs = circle(np.linspace(0, 3, 5000), radius)
    assert orbits.orbit_error(outputs, CIRCLE) == pytest.approx(abs(radius - 1), abs=1e-6)


def test_error_is_relative_to_the_size():
    big = Target("big", PERIOD, lambda t: 50 + circle(t, 30.0))
    outputs = 50 + circle(np.linspace(0, 3, 5000), 33.0)
    assert orbits.orbit_error(outputs, big) == pytest.approx(0.1, abs=1e-6)


def test_half_an_orbit_is_caught_by_the_other_direction():
    """All outputs lie on the circle, but half of the circle has no output near it."""
    half = circle(np.linspace(0, PERIOD / 2, 2000))
    missing = np.linspace(np.pi, 2 * np.pi, 100_001)
    nearest = 2 * np.sin(np.minimum(missing - np.pi, 2 * np.pi - missing) / 2)
    wanted = np.sqrt((nearest**2).mean() / 2)  # the other half has distance 0
    assert orbits.orbit_error(half, CIRCLE) == pytest.approx(wanted, rel=1e-3)


def test_an_excursion_is_caught_although_the_orbit_is_covered():
    """A tenth of the outputs sit 0.5 off the circle: RMS 0.5 sqrt(0.1)."""
    outputs = np.vstack([circle(np.linspace(0, PERIOD, 900)), circle(np.linspace(0, 2, 100), 1.5)])
    assert orbits.orbit_error(outputs, CIRCLE) == pytest.approx(0.5 * np.sqrt(0.1), rel=1e-6)


def test_outputs_at_rest_have_a_large_error():
    centre = np.zeros((100, 2))
    assert orbits.orbit_error(centre, CIRCLE) == pytest.approx(1.0, abs=1e-6)


def test_orbit_error_is_the_brute_force_distance():
    """A noisy orbit against a dense target, all pairs of points."""
    rng = np.random.default_rng(0)
    outputs = VAN_DER_POL.sample(np.linspace(0, 14, 1500)) + 0.1 * rng.normal(size=(1500, 2))
    dense = VAN_DER_POL.orbit(20_000)
    there = np.array([np.sqrt(((dense - x) ** 2).sum(axis=1).min()) for x in outputs])
    error = np.sqrt((there**2).mean()) / orbits.rms_radius(dense)
    assert orbits.orbit_error(outputs, VAN_DER_POL) == pytest.approx(error, rel=1e-3)


def test_rms_radius():
    assert orbits.rms_radius(5 + circle(np.arange(100) / 50, 3.0)) == pytest.approx(3.0, rel=1e-12)


@given(period=st.floats(1.7, 2.3), phase=st.floats(0, 10), seconds=st.floats(4.0, 100.0))
def test_period_of_a_sinusoid(period, phase, seconds):
    """To a fraction of a sample, over as many periods as fit."""
    t = np.arange(0, seconds, 0.01)
    measured = orbits.period(circle(phase + t, period=period), 0.01, 2.0)
    assert measured == pytest.approx(period, rel=2e-5)


def test_period_of_a_noisy_sinusoid():
    """White noise of a tenth of the radius, 50 periods."""
    rng = np.random.default_rng(1)
    t = np.arange(0, 100, 0.01)
    noisy = circle(t, period=2.037) + 0.1 * rng.normal(size=(len(t), 2))
    assert orbits.period(noisy, 0.01, 2.0) == pytest.approx(2.037, rel=2e-4)


@pytest.mark.parametrize("name", ["van_der_pol", "quadratic", "lissajous"])
@pytest.mark.parametrize("speed", [0.9, 0.999, 1.0, 1.002, 1.1])
def test_relative_period_error_of_a_faster_target(name, speed):
    wanted = target(name)
    outputs = wanted.sample(speed * np.arange(0, 40, 1e-3))
    error = orbits.relative_period_error(outputs, 1e-3, wanted)
    assert error == pytest.approx(abs(1 / speed - 1), abs=2e-7)


def test_relative_amplitude_error():
    t = np.linspace(0, 4, 10_001)
    assert orbits.relative_amplitude_error(circle(t, 1.3), CIRCLE) == pytest.approx(0.3, abs=1e-5)
    squeezed = circle(t) * [1.0, 0.6]
    assert orbits.relative_amplitude_error(squeezed, CIRCLE) == pytest.approx(0.4, abs=1e-5)
    assert orbits.relative_amplitude_error(7 + circle(t), CIRCLE) < 1e-5


def test_short_outputs_have_no_period():
    with pytest.raises(InvalidArgumentError, match=r"outputs: expected at least 1.5 periods of 2"):
        orbits.period(circle(np.arange(0, 2.9, 0.01)), 0.01, 2.0)


def test_outputs_at_rest_have_no_period():
    with pytest.raises(InvalidArgumentError, match=r"^outputs: "):
        orbits.period(np.ones((1000, 2)), 0.01, 2.0)


@pytest.mark.parametrize(("name", "value"), [("timestep", 0.0), ("guess", -2.0), ("guess", np.nan)])
def test_period_arguments_are_checked(name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        orbits.period(
            circle(np.arange(0, 9, 0.01)), **{"timestep": 0.01, "guess": 2.0, name: value}
        )
    assert caught.value.name == name


@pytest.mark.parametrize("metric", [orbits.orbit_error, orbits.relative_amplitude_error])
@pytest.mark.parametrize("outputs", [np.ones((10, 3)), np.ones(10), np.full((10, 2), np.nan)])
def test_bad_outputs_are_named(metric, outputs):
    with pytest.raises(InvalidArgumentError, match=r"^outputs: "):
        metric(outputs, CIRCLE)
