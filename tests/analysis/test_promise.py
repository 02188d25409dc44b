"""Measures of a body before teaching, against formulas and against runs of the body itself."""

import numpy as np
import pytest

import mcmj
from mcmj.analysis.promise import linear_measures, promise, response

PERIOD = 6.0


def corner(k1=(4.0, 1.0), d1=(1.0, 4.0)):
    """A mass held by two springs at right angles: two modes, each of one spring."""
    return mcmj.Body(
        positions=[[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]],
        springs=[[0, 1], [0, 2]],
        fixed=np.array([False, True, True]),
        w_fb=[[3.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        k1=k1, k3=[0.0, 0.0], d1=d1, d3=[0.0, 0.0],
    )  # fmt: skip


def test_modes_of_a_mass_on_two_springs():
    # s^2 + d s + k = 0: -1/2 +- i sqrt(15)/2, and -2 +- sqrt(3)
    found = linear_measures(corner(), PERIOD)
    times = np.log10(1.0 / np.array([0.5, 0.5, 2 - np.sqrt(3), 2 + np.sqrt(3)]))
    assert found["slowest"] == pytest.approx(times.max() - np.log10(PERIOD), rel=1e-10)
    assert found["diversity"] == pytest.approx(times.std(), rel=1e-10)
    assert found["oscillating"] == 0.5
    sizes = np.array([2.0, 2.0, 2 - np.sqrt(3), 2 + np.sqrt(3)])  # |s|
    nearest = np.abs(np.log(sizes * PERIOD / (2 * np.pi))).min()
    assert found["nearest"] == pytest.approx(nearest, rel=1e-10)


def test_the_response_is_the_oscillators():
    s = 2j * np.pi / PERIOD
    found = response(corner(), s)
    assert found[0, 0] == pytest.approx(-3.0 / (s**2 + s + 4.0), rel=1e-12)  # pushed: it shortens
    assert found[1, 0] == pytest.approx(0.0, abs=1e-12)
    gain = linear_measures(corner(), PERIOD)["gain"]
    assert gain == pytest.approx(np.log10(abs(3.0 / (s**2 + s + 4.0))), rel=1e-10)


def test_the_response_is_that_of_the_body_under_a_small_force():
    body = mcmj.random_body(2, nodes=8)
    steps, omega, size = 60_000, 2 * np.pi / PERIOD, 1e-3
    times = 1e-3 * np.arange(steps)
    wave = np.zeros((steps, 2))
    wave[:, 0] = size * np.cos(omega * times)
    sim = mcmj.Simulation(body, engine="twin", integrator="leapfrog")
    lengths = sim.rollout(offset=wave, gate=0.0, record=("lengths",)).lengths
    last = slice(steps - round(5 * PERIOD / 1e-3), None)
    seen = 2 * ((lengths - body.rest_lengths)[last].T @ np.exp(-1j * omega * times[last]))
    seen /= size * len(times[last])
    assert seen == pytest.approx(response(body, 1j * omega)[:, 0], abs=2e-3 * np.abs(seen).max())


def test_stronger_feedback_is_more_gain_and_the_same_directions():
    body = mcmj.random_body(0, nodes=8)
    strong = mcmj.Body(
        **{f: getattr(body, f) for f in body.__dataclass_fields__} | {"w_fb": 10 * body.w_fb}
    )
    one, ten = (linear_measures(each, PERIOD) for each in (body, strong))
    for name, value in one.items():
        more = 1.0 if name in ("gain", "weight") else 0.0
        assert ten[name] == pytest.approx(value + more, abs=1e-9), name
    assert 1.0 <= one["dimension"] <= body.n_springs


def test_all_measures_are_numbers_and_the_same_for_a_seed():
    body, target = mcmj.random_body(0, nodes=6), mcmj.target("van_der_pol")
    found = promise(body, target, seed=1)
    assert len(found) == 11
    assert np.isfinite(list(found.values())).all()
    assert promise(body, target, seed=1) == found
