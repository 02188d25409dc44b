"""Bodies, pushes and runs for the tests of the leapfrog."""

import mujoco
import numpy as np

import mcmj

FULL = mujoco.mjtState.mjSTATE_INTEGRATION.value


def toolbox_body(seed, nodes=12, **settings):
    return mcmj.random_body(seed, nodes, d1=(0.1, 2.0), feedback_scale=10.0, **settings)


def small_body(seed, nodes=12):
    return toolbox_body(seed, nodes, width=1.0, height=1.0)


def readout(body, scale=3.0):
    """Random weights whose outputs are 0 at rest."""
    w = np.random.default_rng(5).normal(size=(body.n_springs, body.n_outputs))
    l0 = body.rest_lengths
    return scale * (w - np.outer(l0, l0 @ w) / (l0 @ l0)) / np.sqrt(len(l0))


def push(body):
    rng = np.random.default_rng(7)
    return rng.uniform(1, 10, body.n_nodes) * rng.choice([-1, 1], body.n_nodes)


def kicked(body, speed=0.5):
    """The body's start with every free node moving at that speed."""
    v = np.random.default_rng(9).normal(size=body.positions.shape)
    v *= speed / np.linalg.norm(v, axis=1)[:, None]
    return mcmj.core.trajectory.State(body.positions, np.where(body.fixed[:, None], 0.0, v))


def error(state, exact):
    return np.linalg.norm(state.positions - exact.positions)


def in_mujoco(body, integrator, steps, w_out=None, timestep=1e-3, start=None, **options):
    simulation = mcmj.Simulation(
        body, w_out=w_out, integrator=integrator, timestep=timestep, **options
    )
    if start is not None:
        simulation.set_state(start.positions, start.velocities)
    simulation.rollout(steps, forces=push(body))
    return simulation


def full_state(model, data):
    state = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, state, FULL)
    return state
