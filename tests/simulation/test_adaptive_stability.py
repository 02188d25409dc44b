"""Where the adaptive leapfrog is stable, as predicted from its linearised step."""

import math

import numpy as np
import pytest
from networks import network, readout

from mcmj.core.trajectory import State
from mcmj.reference.integration import integrate
from mcmj.simulation.stepsize.limit import stability_limit
from mcmj.simulation.stepsize.linearisation import linear_system
from mcmj.simulation.stepsize.schemes import parts_of, step_map

NAME = "adaptive_leapfrog"


@pytest.mark.parametrize(("step", "parts"), [(0.04, 2), (0.2, 9)])
@pytest.mark.parametrize("closed", [False, True])
def test_the_step_map_is_the_twins(closed, step, parts):
    body = network(d1=(1.0, 1.5), n_outputs=2)
    w_out = readout(body, 1.0) if closed else None
    system, n = linear_system(body, w_out=w_out), 2 * len(body.free)
    assert parts_of(system, step) == parts
    expected = step_map(system, NAME, step)

    def after(x):
        positions, velocities = body.positions.copy(), np.zeros_like(body.positions)
        positions[body.free] += x[:n].reshape(-1, 2)
        velocities[body.free] = x[n:].reshape(-1, 2)
        end = integrate(
            body, method=NAME, steps=2, timestep=step, w_out=w_out,
            initial_state=State(positions, velocities),
        ).final_state  # fmt: skip
        return (end.positions - body.positions)[body.free].ravel()

    for x in np.random.default_rng(2).standard_normal((6, 2 * n)):
        moved = (after(1e-6 * x) - after(-1e-6 * x)) / 2e-6
        state = np.concatenate([x, x[n:]])  # w = w- = v: V = v
        np.testing.assert_allclose(moved, (expected @ expected @ state)[:n], atol=2e-6)


def test_heavy_dampers_leave_no_limit():
    body = network(d1=(30.0, 60.0))
    assert stability_limit(body, NAME) == math.inf
    assert stability_limit(body, "leapfrog") < 0.01
    kick = 1e-6 * np.random.default_rng(0).standard_normal(body.positions.shape)
    start = State(body.positions, np.where(body.fixed[:, None], 0.0, kick))
    for step in (0.01, 0.1, 1.0):
        run = integrate(body, method=NAME, steps=200, timestep=step, initial_state=start)
        assert np.abs(run.final_state.velocities).max() < 1e-8
        radius = np.abs(np.linalg.eigvals(step_map(linear_system(body), NAME, step))).max()
        assert radius < 1.0


def test_light_dampers_leave_the_leapfrogs_limit():
    body = network(d1=(0.05, 0.1))
    limit = stability_limit(body, NAME)
    assert limit == stability_limit(body, "leapfrog") < 0.1
    for factor, stable in ((0.99, True), (1.01, False)):
        system = linear_system(body)
        radius = np.abs(np.linalg.eigvals(step_map(system, NAME, factor * limit))).max()
        assert bool(radius < 1.0) is stable
