from dataclasses import replace

import numpy as np
import pytest
from networks import network, readout, simulation

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.reference.dop853 import accelerations
from mcmj.simulation.stepsize.linearisation import Motion, linear_system, linearise
from mcmj.simulation.stepsize.schemes import step_map


def in_space(body, depth):
    """A body with a depth is pushed along a direction that is no axis."""
    return replace(body, direction=[2.0, -1.0, 2.0]) if depth else body


@pytest.mark.parametrize("depth", [0.0, 1.0])
def test_matrices_are_the_derivatives_of_the_forces(depth):
    body = in_space(network(cubic=50.0, n_outputs=2, depth=depth), depth)
    rng = np.random.default_rng(1)
    w_out, gate = rng.standard_normal((body.n_springs, 2)), np.array([0.5, 2.0])
    where = body.positions + 0.02 * rng.standard_normal(body.positions.shape) * ~body.fixed[:, None]
    K, D = linearise(body, where, w_out=w_out, gate=gate)

    def forces(q, v):
        positions, velocities = where.copy(), np.zeros_like(where)
        positions[body.free] += q.reshape(-1, body.dimensions)
        velocities[body.free] = v.reshape(-1, body.dimensions)
        push = body.w_fb @ (gate * (mcmj.core.body.spring_lengths(positions, body.springs) @ w_out))
        change = accelerations(body, positions, velocities, push) * body.masses[:, None]
        return change[body.free].ravel()

    n, eps = body.dimensions * len(body.free), 1e-5
    zero = np.zeros(n)
    by_q = [(forces(e, zero) - forces(-e, zero)) / (2 * eps) for e in eps * np.eye(n)]
    by_v = [(forces(zero, e) - forces(zero, -e)) / (2 * eps) for e in eps * np.eye(n)]
    np.testing.assert_allclose(K.toarray(), -np.transpose(by_q), atol=1e-5)
    np.testing.assert_allclose(D.toarray(), -np.transpose(by_v), atol=1e-5)


def test_a_law_of_your_own_has_its_slopes_by_differences():
    body = network(cubic=50.0)
    law = mcmj.SpringLaw("same", lambda x1, x2, k1, k3, d1, d3: x1 * (k1 + k3 * x1 * x1) + d1 * x2)
    linear = mcmj.Body(**{n: getattr(body, n) for n in ("positions", "springs", "k1", "k3", "d1")},
                       d3=np.zeros(body.n_springs), masses=body.masses)  # fmt: skip
    for secant in (False, True):
        own = linear_system(body, motion=Motion(0.1, 0.3, secant), springs=law)
        native = linear_system(linear, motion=Motion(0.1, 0.3, secant))
        for name in ("material", "geometric", "damping"):
            a, b = getattr(own, name).toarray(), getattr(native, name).toarray()
            np.testing.assert_allclose(a, b, atol=1e-5)


@pytest.mark.parametrize("depth", [0.0, 1.0])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "leapfrog"])
def test_step_maps_are_those_of_mujoco(integrator, closed, depth):
    body = in_space(network(n_outputs=2, depth=depth), depth)
    w_out = readout(body, 1.0) if closed else None
    n, step = body.dimensions * len(body.free), 0.02
    sim = simulation(body, integrator, step, w_out)

    def after(x):
        sim.reset()
        positions, velocities = body.positions.copy(), np.zeros_like(body.positions)
        positions[body.free] += x[:n].reshape(-1, body.dimensions)
        velocities[body.free] = x[n:].reshape(-1, body.dimensions)
        sim.set_state(positions, velocities)
        end = sim.rollout(1).final_state
        moved = (end.positions - body.positions)[body.free]
        return np.concatenate([moved, end.velocities[body.free]], axis=None)

    expected = step_map(linear_system(body, w_out=w_out), integrator, step)
    # all coordinates at once: at a spring's very rest length MuJoCo takes its stiffness for 0
    for x in np.random.default_rng(2).standard_normal((6, 2 * n)):
        change = (after(1e-6 * x) - after(-1e-6 * x)) / 2e-6
        np.testing.assert_allclose(change, expected @ x, atol=2e-6)
